// Logs in CSV as a recording.
#pragma once

#include <string>

#include "field_bags/recording.hpp"

namespace field_bags {

/// Reads `stamp_s,x_m,y_m,yaw_rad` (odometry, and truth unless its path is empty) and `stamp_s`
/// with one column per field (measurements; an empty cell: not observed; a row without any value is
/// left out).
/// @throws field_core::DataError naming file, line and column, and what to do: missing file or
/// column, no
///         number, NaN, stamps that do not increase, nothing measured
Recording read_csv_recording(const std::string& odometry, const std::string& measurements,
                             const std::string& truth);

}  // namespace field_bags
