// What a configuration with correlated fields refuses, and what it then says.
#include <gtest/gtest.h>

#include "correlated_world.hpp"
#include "field_core/errors.hpp"

using namespace gp_localize;

namespace {

class Refused : public ::testing::Test {
 protected:
  void expect(const std::vector<std::string>& parts) const {
    try {
      p.validate();
      FAIL() << "not refused; expected: " << parts.front();
    } catch (const field_core::ParameterError& error) {
      for (const std::string& part : parts) {
        EXPECT_NE(std::string::npos, std::string(error.what()).find(part)) << error.what();
      }
    }
  }
  CoregionalizationParams& room() { return p.coregionalization.at("room"); }
  GpLocalizeParams p = params();
};

TEST_F(Refused, NotUnlessSomethingIsWrong) { EXPECT_NO_THROW(p.validate()); }
TEST_F(Refused, AFieldThatIsNotThere) {
  room().fields[1] = "c";
  expect({"coregionalization/room/fields", "'c'", "add it"});
}
TEST_F(Refused, AFieldTwice) {
  p.coregionalization["house"] = {{"b", "a"}, {0.1}};
  expect({"coregionalization/room/fields", "'a'", "one group only"});
}
TEST_F(Refused, AGroupOfOne) {
  room() = {{"a"}, {}};
  expect({"coregionalization/room/fields", "two or more"});
}
TEST_F(Refused, TheWrongNumberOfCorrelations) {
  room().correlations.push_back(0.1);
  expect({"coregionalization/room/correlations", "2 fields need 1"});
}
TEST_F(Refused, CorrelationsThatContradictEachOther) {
  p.fields["c"] = p.fields["b"];
  room() = {{"a", "b", "c"}, {0.9, 0.9, -0.9}};
  expect({"coregionalization/room/correlations", "'c'", "closer to 0", "--coregionalize"});
  room() = {{"a", "b", "c"}, {1.0, 0.0, 0.0}};
  expect({"coregionalization/room/correlations", "'b'"});
}
TEST_F(Refused, OtherLengthScalesOrKernels) {
  p.fields["b"].length_scales[1] = 1.6;
  expect({"coregionalization/room/fields", "'b'", "'a'", "--coregionalize"});
  p = params();
  p.fields["b"].kernel = field_core::KernelType::matern32;
  expect({"coregionalization/room/fields", "'b'", "make them the same"});
}
TEST_F(Refused, WhatIsNotOffered) {
  p.outlier_share = 0.1;
  expect({"outlier_share", "coregionalization"});
  p = params();
  p.support.noisy = true;
  expect({"support/noisy", "coregionalization"});
  p = params();
  p.map_hypotheses = MapHypotheses::sample_paths;
  p.observation_model = ObservationModelType::full_gp;
  expect({"observation_model", "online_pitc_assimilated"});
  p = params();
  p.support.size = 201;
  expect({"support/size", "at most 200"});
}

}  // namespace
