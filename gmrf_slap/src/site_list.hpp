// The sites that rows name, each once.
#pragma once

#include <algorithm>
#include <vector>

#include "gmrf_slap/lattice.hpp"

namespace gmrf_slap {

inline void add_sites(const SiteRow& row, std::vector<int>& sites) {
  sites.insert(sites.end(), row.site.begin(), row.site.begin() + row.count);
}

inline void sort_unique(std::vector<int>& sites) {
  std::sort(sites.begin(), sites.end());
  sites.erase(std::unique(sites.begin(), sites.end()), sites.end());
}

inline std::vector<int> sites_of(const std::vector<SiteRow>& rows) {
  std::vector<int> sites;
  for (const SiteRow& row : rows) add_sites(row, sites);
  sort_unique(sites);
  return sites;
}

}  // namespace gmrf_slap
