#include "harness/recorded_kick.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/at.h"

namespace cutproof::harness {

const std::vector<KnownArray>& kick_arrays() {
  static const std::vector<KnownArray> known = {
      {"positions", "where particles were, frame by frame [m]"},
      {"kicked", "the same simulation with a kick of one piece"},
      {"piece", "which particles belong together"},
      {"alive", "frame by frame, 1: the particle exists, 0: not yet, or no longer"},
      {"again", "the first simulation once more: its noise"},
      {"kicked_piece", "which piece was kicked"},
      {"spacing", "h [m], for the report"},
      {"time", "when each frame was [s], for the report"},
  };
  return known;
}

RecordedKick recorded_kick_of(const io::ArrayFile& contents, const std::string& file) {
  const NamedArrays in(contents, file, kick_arrays(), {});
  RecordedKick kick;
  oracles::KickedRuns& runs = kick.runs;
  const Array& positions = in.require("positions", {-1, -1, 3});
  if (positions.shape[1] > std::numeric_limits<int32_t>::max()) {
    in.refuse("positions", "There are more particles than 32-bit numbers can name.", "Write a smaller body.");
  }
  if (positions.shape[0] == 0 || positions.shape[1] == 0) {
    in.refuse("positions", "There are no frames, or no particles.", "Write at least one of both.");
  }
  runs.frames = positions.shape[0];
  runs.particles = static_cast<int32_t>(positions.shape[1]);
  runs.precision = precision_of(positions);
  const auto run_of = [&](const Array& array) {
    if (!is_real(array) || array.type != positions.type) {
      in.refuse(array.name,
                fmt::format("It holds {}, and positions hold {}.", name_of(array.type), name_of(positions.type)),
                "Write all runs in the precision in which they were computed: float32 or float64.");
    }
    return in.numbers(array);
  };
  runs.positions = run_of(positions);
  runs.kicked = run_of(in.require("kicked", positions.shape));
  if (const Array* const again = in.find("again", positions.shape)) runs.again = run_of(*again);
  if (const Array* const alive = in.find("alive", {runs.frames, runs.particles})) {
    for (const int64_t flag : in.long_integers(*alive)) {
      if (flag != 0 && flag != 1) in.refuse("alive", fmt::format("It holds {}.", flag), "Write 1 or 0.");
      runs.alive.push_back(static_cast<uint8_t>(flag));
    }
  }
  runs.piece = in.integers(in.require("piece", {runs.particles}));
  if (const auto piece = in.whole_number("kicked_piece")) {
    const auto found = std::find(runs.piece.begin(), runs.piece.end(), *piece);
    if (found == runs.piece.end()) {
      in.refuse("kicked_piece", fmt::format("There is no piece {}.", *piece), "Give one of those that piece names.");
    }
    runs.kicked_piece = *found;
  }
  if (const auto spacing = in.number("spacing")) {
    if (!(*spacing > 0) || !std::isfinite(*spacing)) {
      in.refuse("spacing", fmt::format("This is {}.", *spacing), "Give a positive, finite number.");
    }
    runs.spacing = *spacing;
  }
  if (const Array* const time = in.find("time", {runs.frames})) kick.time = in.numbers(*time);
  kick.notes = in.notes();
  return kick;
}

}  // namespace cutproof::harness
