// Time of the suite: integer nanoseconds, so that the same bag always gives the same numbers.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace field_core {

/// Nanoseconds since the epoch of the clock that stamped the messages.
using Stamp = std::chrono::nanoseconds;

inline double to_seconds(Stamp stamp) { return static_cast<double>(stamp.count()) * 1e-9; }

/// Nearest nanosecond; exact for every value below 2^53 ns = 104 days, to 0.24 us for epoch times.
Stamp stamp_from_seconds(double seconds);

/// "seconds.nanoseconds" with nine decimals, exact.
std::string format_stamp(Stamp stamp);

/// Inverse of format_stamp, exact for up to nine decimals; throws DataError for anything that is no
/// decimal number.
Stamp parse_stamp(const std::string& text);

}  // namespace field_core
