// The six stages of a frame, in order (method.md §9; Table 1 of the paper). These names are used everywhere.
#pragma once
#include <array>
#include <string_view>

namespace cutproof {

enum class Stage { step, detect, split, merge, expand, skin };

inline constexpr std::array<Stage, 6> kStages = {Stage::step,  Stage::detect, Stage::split,
                                                 Stage::merge, Stage::expand, Stage::skin};
inline constexpr std::array<std::string_view, 6> kStageNames = {"step", "detect", "split", "merge", "expand", "skin"};

inline constexpr std::string_view name_of(Stage stage) { return kStageNames[static_cast<std::size_t>(stage)]; }

// A contiguous run of stages within one frame, both ends included.
struct Span {
  Stage first = Stage::step;
  Stage last = Stage::skin;

  constexpr bool contains(Stage stage) const { return first <= stage && stage <= last; }
  constexpr bool is_whole_frame() const { return first == Stage::step && last == Stage::skin; }
  friend bool operator==(const Span&, const Span&) = default;
};

}  // namespace cutproof
