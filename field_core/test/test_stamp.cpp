#include <gtest/gtest.h>

#include <limits>

#include "field_core/errors.hpp"
#include "field_core/random.hpp"
#include "field_core/stamp.hpp"
#include "support.hpp"

namespace field_core {
namespace {

TEST(Stamp, TextRoundTripsExactly) {
  Random random(5);
  for (int k = 0; k < 1000; ++k) {
    const Stamp stamp(static_cast<std::int64_t>(random.uniform(-9.2e18, 9.2e18)));
    EXPECT_EQ(parse_stamp(format_stamp(stamp)), stamp);
  }
  for (const std::int64_t ns : {std::int64_t{0}, std::int64_t{1}, std::int64_t{-1},
                                std::int64_t{999999999}, std::int64_t{1600000000123456789}}) {
    EXPECT_EQ(parse_stamp(format_stamp(Stamp(ns))), Stamp(ns));
  }
}

TEST(Stamp, TextIsDecimalSeconds) {
  EXPECT_EQ(format_stamp(Stamp(1600000000000000001)), "1600000000.000000001");
  EXPECT_EQ(format_stamp(Stamp(-1500000000)), "-1.500000000");
  EXPECT_EQ(parse_stamp("12.5"), Stamp(12500000000));
  EXPECT_EQ(parse_stamp("12"), Stamp(12000000000));
  EXPECT_EQ(parse_stamp(".25"), Stamp(250000000));
  EXPECT_EQ(parse_stamp("-0.5"), Stamp(-500000000));
  EXPECT_EQ(parse_stamp("1.5e3"), Stamp(1500000000000));
  EXPECT_EQ(parse_stamp("1.234567890999"), Stamp(1234567890));  // beyond nanoseconds: cut
}

TEST(Stamp, SecondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(stamp_from_seconds(0.1), Stamp(100000000));
  EXPECT_EQ(stamp_from_seconds(-0.1), Stamp(-100000000));
  EXPECT_EQ(stamp_from_seconds(1.0 - 1e-12), Stamp(1000000000));
  EXPECT_DOUBLE_EQ(to_seconds(Stamp(1500000000)), 1.5);
  // Below 2^53 ns every nanosecond is a double of its own.
  Random random(6);
  for (int k = 0; k < 1000; ++k) {
    const Stamp stamp(static_cast<std::int64_t>(random.uniform(0.0, 4e15)));
    EXPECT_EQ(stamp_from_seconds(to_seconds(stamp)), stamp);
  }
}

TEST(Stamp, AnythingElseIsRefusedByName) {
  for (const char* text : {"", "-", ".", "nan", "inf", "1,5", "1.5s", "e5", "0x10", "1e99", " 1",
                           "99999999999", "+-1", "1.2.3"}) {
    SCOPED_TRACE(text);
    test::expect_error<DataError>([&] { parse_stamp(text); },
                                  {std::string("'") + text + "'", "12.5"});
  }
}

}  // namespace
}  // namespace field_core
