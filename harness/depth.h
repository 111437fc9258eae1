// The depth of judging a run.
#pragma once
#include <array>
#include <optional>
#include <string_view>

#include "oracles/registry.h"

namespace cutproof::harness {

enum class Depth {
  topology,  // properties that follow from states alone: cheap
  motion     // everything: also every step, and of a backend that can be run again, relations between its runs
};
inline constexpr std::array<std::string_view, 2> kDepthNames = {"topology", "motion"};

constexpr std::string_view name_of(Depth depth) { return kDepthNames[static_cast<std::size_t>(depth)]; }
// Nothing if no depth has this name.
std::optional<Depth> depth_named(std::string_view name);

// The properties that are judged at this depth.
oracles::PropertyLists properties_of(Depth depth);

}  // namespace cutproof::harness
