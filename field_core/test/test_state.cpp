#include <gtest/gtest.h>

#include "field_core/errors.hpp"
#include "field_core/state.hpp"
#include "support.hpp"

namespace field_core {
namespace {

TEST(State, GivesBackWhatWasSet) {
  State state("gp", 3);
  const Eigen::MatrixXd block = Eigen::MatrixXd::Random(2, 5);
  state.set("block", block);
  state.set("scalar", 0.1);
  state.set_text("random", "1 2 3");
  EXPECT_EQ(state.matrix("block"), block);
  EXPECT_EQ(state.matrix("block", 2, -1), block);
  EXPECT_EQ(state.scalar("scalar"), 0.1);
  EXPECT_EQ(state.text("random"), "1 2 3");
  EXPECT_NO_THROW(state.require("gp", 3));
}

TEST(State, RefusesWhatDoesNotFitByName) {
  State state("gp", 3);
  state.set("block", Eigen::MatrixXd::Zero(2, 5));
  test::expect_error<DataError>([&] { state.matrix("other"); }, {"'other'"});
  test::expect_error<DataError>([&] { state.matrix("block", 3, -1); },
                                {"'block'", "2 x 5", "3 x any"});
  test::expect_error<DataError>([&] { state.scalar("block"); }, {"1 x 1"});
  test::expect_error<DataError>([&] { state.text("block"); }, {"'block'"});
  test::expect_error<DataError>([&] { state.require("gmrf", 3); }, {"'gp'", "'gmrf'"});
  test::expect_error<DataError>([&] { state.require("gp", 4); }, {"version 3", "4"});
}

}  // namespace
}  // namespace field_core
