#include "harness/recorded_kick.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/at.h"

namespace cutproof::harness {

const std::vector<KnownArray>& kick_arrays() {
  static const std::vector<KnownArray> known = {
      {"positions", "positions of particles, frame by frame [m]"},
      {"kicked", "the same simulation with a kick of one piece, or with one kick after the other"},
      {"piece", "pieces: particles that belong together"},
      {"alive", "frame by frame, 1: the particle exists, 0: it does not"},
      {"again", "the first simulation repeated, to measure its noise"},
      {"kicked_piece", "piece that each kick moved"},
      {"directions", "direction of each kick, of any length"},
      {"equal", "kicks with equal answers have the same number; below 0: none"},
      {"tolerance", "share of a kick that other pieces may feel"},
      {"mass", "masses of particles [kg]"},
      {"steps", "substeps in a frame"},
      {"spacing", "h [m], for the report"},
      {"time", "time of each frame [s], for the report"},
  };
  return known;
}

namespace {

// Which piece each kick was of, to where, and which are equal.
void read_kicks(const NamedArrays& in, oracles::KickedRuns& runs) {
  const std::ptrdiff_t count = std::ssize(runs.kicks);
  if (in.has("kicked_piece")) {
    const std::vector<int32_t> named = in.integers(in.require_either("kicked_piece", {count}, {}));
    for (std::size_t k = 0; k < runs.kicks.size(); ++k) {
      const int32_t piece = named.size() == 1 ? named.front() : named[k];
      if (std::find(runs.piece.begin(), runs.piece.end(), piece) == runs.piece.end()) {
        in.refuse("kicked_piece", fmt::format("There is no piece {}.", piece), "Give one of those that piece names.");
      }
      runs.kicks[k].piece = piece;
    }
  }
  if (const Array* const directions = in.find("directions", {count, 3})) {
    const std::vector<double> given = in.numbers(*directions);
    for (std::size_t k = 0; k < runs.kicks.size(); ++k) {
      const Vec3 direction = {given[3 * k], given[3 * k + 1], given[3 * k + 2]};
      if (!(norm(direction) > 0) || !std::isfinite(norm(direction))) {
        in.refuse("directions", fmt::format("Row {} is ({}, {}, {}).", k, direction.x, direction.y, direction.z),
                  "Give the push of each kick, for example the velocity that it adds.");
      }
      runs.kicks[k].direction = direction;
    }
  }
  if (const Array* const equal = in.find("equal", {count})) {
    const std::vector<int32_t> group = in.integers(*equal);
    for (std::size_t k = 0; k < group.size(); ++k) {
      if (group[k] >= 0 && std::count(group.begin(), group.end(), group[k]) == 1) {
        in.refuse("equal", fmt::format("Only kick {} has the number {}.", k, group[k]),
                  "Give kicks with equal answers the same number, and a single kick -1.");
      }
      runs.kicks[k].equal = group[k];
    }
  }
}

// Single numbers, and the masses.
void read_numbers(const NamedArrays& in, oracles::KickedRuns& runs) {
  if (const auto spacing = in.number("spacing")) {
    if (!(*spacing > 0) || !std::isfinite(*spacing)) {
      in.refuse("spacing", fmt::format("This is {}.", *spacing), "Give a positive, finite number.");
    }
    runs.spacing = *spacing;
  }
  if (const auto tolerance = in.number("tolerance")) {
    if (!(*tolerance >= 0 && *tolerance < 1)) {
      in.refuse("tolerance", fmt::format("This is {}.", *tolerance),
                "Give the share of a kick that other pieces may feel: at least 0, and less than 1.");
    }
    runs.tolerance = *tolerance;
  }
  if (const auto steps = in.whole_number("steps")) {
    if (*steps < 1) in.refuse("steps", fmt::format("This is {}.", *steps), "Give the number of substeps in a frame.");
    runs.steps = *steps;
  }
  if (const Array* const mass = in.find("mass", {runs.particles})) {
    runs.mass = in.numbers(*mass);
    for (std::size_t i = 0; i < runs.mass.size(); ++i) {
      if (runs.mass[i] > 0 && std::isfinite(runs.mass[i])) continue;
      in.refuse("mass", fmt::format("That of particle {} is {}.", i, runs.mass[i]), "Give positive, finite numbers.");
    }
  }
}

// Notes on properties that are not judged, because an array is missing.
void say_what_is_not_judged(RecordedKick& kick) {
  const std::vector<oracles::KickedRun>& kicks = kick.runs.kicks;
  if (!kicks.front().direction) kick.notes.push_back("Not judged: the answer follows the kick (no directions).");
  if (std::all_of(kicks.begin(), kicks.end(), [](const oracles::KickedRun& each) { return each.equal < 0; })) {
    kick.notes.push_back("Not judged: equal answers (no kicks are stated to be equal).");
  }
}

}  // namespace

RecordedKick recorded_kick_of(const io::ArrayFile& contents, const std::string& file) {
  const NamedArrays in(contents, file, kick_arrays(), {});
  RecordedKick kick;
  oracles::KickedRuns& runs = kick.runs;
  const Array& positions = in.require("positions", {-1, -1, 3});
  if (positions.count() == 0) {
    in.refuse("positions", "There are no frames, or no particles.", "Write at least one of both.");
  }
  if (positions.shape[1] > std::numeric_limits<int32_t>::max()) {
    in.refuse("positions", "There are more particles than 32-bit numbers can name.", "Write a smaller body.");
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
  const Array& kicked = in.require_either("kicked", positions.shape, {-1, runs.frames, runs.particles, 3});
  if (kicked.count() == 0) in.refuse("kicked", "There is no kick.", "Write at least one.");
  const std::vector<double> all = run_of(kicked);
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end = begin + std::ssize(runs.positions);
    runs.kicks.emplace_back().positions.assign(begin, end);
    begin = end;
  }
  if (const Array* const again = in.find("again", positions.shape)) runs.again = run_of(*again);
  if (const Array* const alive = in.find("alive", {runs.frames, runs.particles})) {
    for (const int64_t flag : in.long_integers(*alive)) {
      if (flag != 0 && flag != 1) in.refuse("alive", fmt::format("It holds {}.", flag), "Write 1 or 0.");
      runs.alive.push_back(static_cast<uint8_t>(flag));
    }
  }
  runs.piece = in.integers(in.require("piece", {runs.particles}));
  read_kicks(in, runs);
  read_numbers(in, runs);
  if (const Array* const time = in.find("time", {runs.frames})) kick.time = in.numbers(*time);
  kick.notes = in.notes();
  say_what_is_not_judged(kick);
  return kick;
}

}  // namespace cutproof::harness
