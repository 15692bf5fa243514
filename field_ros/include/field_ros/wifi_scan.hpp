// Output of `iw dev <interface> scan` as measurements: pure, without a ROS node.
#pragma once

#include <field_msgs/FieldMeasurement.h>

#include <map>
#include <string>
#include <vector>

namespace field_ros {

struct AccessPoint {
  std::string bssid;  ///< "aa:bb:cc:dd:ee:ff", lower case
  std::string ssid;   ///< "" if hidden
  double frequency_mhz = 0.0;
  double signal_dbm = 0.0;
};

/// The access points of a scan in the order of the text; those without a signal are left out, as
/// are lines that are none of BSS, freq, signal and SSID.
std::vector<AccessPoint> parse_iw_scan(const std::string& text);

/// Name of an access point's field, legal as a topic: "ap_aabbccddeeff".
std::string field_of(const AccessPoint& access_point);

/// One field per access point [dBm]; of one seen twice the stronger signal. `names` renames fields
/// by BSSID; if `only_named`, others are left out. Header and variances are the caller's.
field_msgs::FieldMeasurement to_field(const std::vector<AccessPoint>& scan,
                                      const std::map<std::string, std::string>& names,
                                      bool only_named);

}  // namespace field_ros
