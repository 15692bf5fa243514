// Logs in CSV as a recording.
#pragma once

#include <string>

#include "field_bags/recording.hpp"

namespace field_bags {

/// Order of the rows of measurements. `any` sorts them by stamp and joins rows that share one:
/// logs of several sensors, or of a logger that wrote its buffers late.
enum class RowOrder { increasing, any };

/// Reads `stamp_s,x_m,y_m,yaw_rad` (odometry, and truth unless its path is empty) and `stamp_s`
/// with one column per field (measurements; an empty cell: not observed; a row without any value is
/// left out).
/// @throws field_core::DataError naming file, line and column, and what to do: missing file or
/// column, no
///         number, NaN, stamps that do not increase (of poses always, of measurements with
///         RowOrder::increasing), nothing measured
Recording read_csv_recording(const std::string& odometry, const std::string& measurements,
                             const std::string& truth, RowOrder order = RowOrder::increasing);

}  // namespace field_bags
