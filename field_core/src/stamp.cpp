#include "field_core/stamp.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "field_core/errors.hpp"

namespace field_core {

Stamp stamp_from_seconds(double seconds) {
  const double whole = std::floor(seconds);
  return std::chrono::seconds(static_cast<std::int64_t>(whole)) +
         Stamp(std::llround((seconds - whole) * 1e9));
}

std::string format_stamp(Stamp stamp) {
  const std::int64_t ns = stamp.count();
  const std::uint64_t size = ns < 0 ? 0ULL - static_cast<std::uint64_t>(ns) : ns;
  char text[40];
  std::snprintf(text, sizeof text, "%s%llu.%09llu", ns < 0 ? "-" : "",
                static_cast<unsigned long long>(size / 1000000000ULL),
                static_cast<unsigned long long>(size % 1000000000ULL));
  return text;
}

Stamp parse_stamp(const std::string& text) {
  const auto fail = [&text]() {
    return DataError("'" + text +
                     "' is not a time in seconds; write a decimal number such as 12.5");
  };
  std::size_t i = 0;
  const bool negative = !text.empty() && text[0] == '-';
  if (negative) i = 1;
  std::int64_t whole = 0, fraction = 0;
  std::size_t digits = 0, decimals = 0;
  for (; i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])); ++i, ++digits) {
    if (whole > 922337202) throw fail();  // beyond what 64-bit nanoseconds hold
    whole = whole * 10 + (text[i] - '0');
  }
  if (i < text.size() && text[i] == '.') {
    for (++i; i < text.size() && std::isdigit(static_cast<unsigned char>(text[i]));
         ++i, ++decimals) {
      if (decimals < 9) fraction = fraction * 10 + (text[i] - '0');
    }
  }
  if (i < text.size() && (text[i] == 'e' || text[i] == 'E')) {
    // Spreadsheets and numpy write exponents; nanoseconds are then rounded as a double allows.
    char* end = nullptr;
    const double seconds = std::strtod(text.c_str(), &end);
    if (end != text.c_str() + text.size() || !(std::abs(seconds) < 9e9)) throw fail();
    return stamp_from_seconds(seconds);
  }
  if (i != text.size() || digits + decimals == 0) throw fail();
  for (std::size_t k = std::min<std::size_t>(decimals, 9); k < 9; ++k) fraction *= 10;
  const Stamp stamp(whole * 1000000000 + fraction);
  return negative ? -stamp : stamp;
}

}  // namespace field_core
