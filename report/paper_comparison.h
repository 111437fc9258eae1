// Table 3 of Yu et al. 2024, "Comparison between our simulation and previous works": time of a frame by number of
// particles, as the paper gives it.
#pragma once
#include <array>
#include <cstdint>

namespace cutproof::report {

inline constexpr std::array kComparedWorks = {"Pan", "Wu", "Berndt", "CPIC", "the paper's"};
struct ComparedSize {
  int64_t particles = 0;
  std::array<double, kComparedWorks.size()> frame_ms = {};
};
inline constexpr ComparedSize kComparedSizes[] = {{12'800, {22.1, 70.2, 13.6, 22.4, 20.2}},
                                                  {37'704, {56.3, 310.6, 38.9, 45.6, 42.1}},
                                                  {48'385, {64.4, 601.1, 46.0, 52.0, 47.0}},
                                                  {101'096, {105.7, 2038.6, 56.2, 70.2, 59.8}}};

}  // namespace cutproof::report
