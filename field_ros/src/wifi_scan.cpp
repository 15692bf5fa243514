#include "field_ros/wifi_scan.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>

namespace field_ros {
namespace {

constexpr std::size_t kBssidLength = 17;

// What follows "key" on a line that begins with it, after white space; nullopt otherwise.
std::optional<std::string> after(const std::string& line, const std::string& key) {
  const std::size_t start = line.find_first_not_of(" \t");
  if (start == std::string::npos || line.compare(start, key.size(), key) != 0) return std::nullopt;
  const std::size_t value = line.find_first_not_of(" \t", start + key.size());
  return value == std::string::npos ? "" : line.substr(value);
}

// "BSS aa:bb:cc:dd:ee:ff(on wlan0) -- associated"; "BSS Load:" and the like are none.
std::optional<std::string> bssid_of(const std::string& line) {
  if (line.compare(0, 4, "BSS ") != 0 || line.size() < 4 + kBssidLength) return std::nullopt;
  std::string text = line.substr(4, kBssidLength);
  for (std::size_t i = 0; i < kBssidLength; ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (i % 3 == 2 ? c != ':' : !std::isxdigit(c)) return std::nullopt;
    text[i] = static_cast<char>(std::tolower(c));
  }
  return text;
}

std::optional<double> number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

std::vector<AccessPoint> parse_iw_scan(const std::string& text) {
  std::vector<AccessPoint> found;
  AccessPoint current;
  bool has_signal = false;
  const auto finish = [&] {
    if (!current.bssid.empty() && has_signal) found.push_back(current);
    current = AccessPoint();
    has_signal = false;
  };
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (const auto bssid = bssid_of(line)) {
      finish();
      current.bssid = *bssid;
    } else if (const auto frequency = after(line, "freq:")) {
      current.frequency_mhz = number(*frequency).value_or(0.0);
    } else if (const auto signal = after(line, "signal:")) {
      const auto dbm = number(*signal);
      has_signal = dbm && signal->find("dBm") != std::string::npos;
      current.signal_dbm = dbm.value_or(0.0);
    } else if (const auto ssid = after(line, "SSID:")) {
      current.ssid = *ssid;
    }
  }
  finish();
  return found;
}

std::string field_of(const AccessPoint& access_point) {
  std::string name = "ap_";
  for (const char c : access_point.bssid) {
    if (c != ':') name += c;
  }
  return name;
}

field_msgs::FieldMeasurement to_field(const std::vector<AccessPoint>& scan,
                                      const std::map<std::string, std::string>& names,
                                      bool only_named) {
  std::map<std::string, double> strongest;
  for (const AccessPoint& point : scan) {
    const auto named = names.find(point.bssid);
    if (only_named && named == names.end()) continue;
    const std::string name = named == names.end() ? field_of(point) : named->second;
    const auto [entry, is_new] = strongest.emplace(name, point.signal_dbm);
    if (!is_new) entry->second = std::max(entry->second, point.signal_dbm);
  }
  field_msgs::FieldMeasurement measurement;
  for (const auto& [name, dbm] : strongest) {
    measurement.names.push_back(name);
    measurement.values.push_back(dbm);
  }
  return measurement;
}

}  // namespace field_ros
