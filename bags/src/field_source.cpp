#include "field_bags/field_source.hpp"

namespace field_bags {

field_core::Random random_stream(std::uint64_t seed, const std::string& purpose) {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a over the purpose, then the seed's bytes
  const auto mix = [&hash](unsigned char byte) { hash = (hash ^ byte) * 1099511628211ULL; };
  for (const char c : purpose) mix(static_cast<unsigned char>(c));
  for (int shift = 0; shift < 64; shift += 8) mix(static_cast<unsigned char>(seed >> shift));
  return field_core::Random(hash);
}

}  // namespace field_bags
