#include "oracles/relations/kick.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "model/at.h"

namespace cutproof::oracles {

namespace {

// How many times the noise that was seen once another run may have, at most (tolerances.md, A kick in a noisy
// simulator).
constexpr double kNoiseFactor = 64;

std::size_t entry(const KickedRuns& runs, int64_t frame, int32_t particle) {
  return 3 * (at(frame) * at(runs.particles) + at(particle));
}

// One of the runs, with the frame from which on each particle exists in it.
class Run {
 public:
  Run(const KickedRuns& runs, const std::vector<double>& positions) : runs_(runs), positions_(positions) {
    if (!runs.alive.empty() || positions.empty()) return;
    for (int32_t i = 0; i < runs.particles; ++i) {
      int64_t frame = 0;
      while (frame < runs.frames && is_blank(frame, i)) ++frame;
      begins_.push_back(frame);
    }
  }
  bool exists(int64_t frame, int32_t i) const {
    if (!runs_.alive.empty()) return runs_.alive[at(frame) * at(runs_.particles) + at(i)] != 0;
    return frame >= begins_[at(i)];
  }
  const double* at_frame(int64_t frame, int32_t i) const { return positions_.data() + entry(runs_, frame, i); }

 private:
  bool is_blank(int64_t frame, int32_t i) const {
    const double* const x = at_frame(frame, i);
    return std::isnan(x[0]) && std::isnan(x[1]) && std::isnan(x[2]);
  }
  const KickedRuns& runs_;
  const std::vector<double>& positions_;
  std::vector<int64_t> begins_;  // [n]
};

// [m]; infinite where one of the two is not a number, or exists in one run alone. No square is taken: that of 1e-163 m
// is 0.
double distance(const Run& a, const Run& b, int64_t frame, int32_t i) {
  const bool in_a = a.exists(frame, i), in_b = b.exists(frame, i);
  if (!in_a && !in_b) return 0;
  if (in_a != in_b) return INFINITY;
  const double *const p = a.at_frame(frame, i), *const q = b.at_frame(frame, i);
  const double length = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  return std::isnan(length) ? INFINITY : length;
}

Verdict kick_verdict(const char* property, const char* source, const char* unit) {
  Verdict verdict;
  verdict.property = property;
  verdict.backend = "file";
  verdict.unit = unit;
  verdict.bound_source = source;
  return verdict;
}

Verdict check_numbers(const KickedRuns& runs) {
  Verdict verdict = kick_verdict("finite", "oracles.md, A kick", "1");
  for (const auto& [name, positions] :
       {std::pair{"positions", &runs.positions}, std::pair{"kicked", &runs.kicked}, std::pair{"again", &runs.again}}) {
    if (positions->empty()) continue;
    const Run run(runs, *positions);
    for (int64_t frame = 0; frame < runs.frames; ++frame) {
      for (int32_t i = 0; i < runs.particles; ++i) {
        if (!run.exists(frame, i)) continue;
        for (int axis = 0; axis < 3; ++axis) {
          ++verdict.checked;
          if (std::isfinite(run.at_frame(frame, i)[axis])) continue;
          verdict.measured += 1;
          if (!verdict.holds) continue;
          verdict.holds = false;
          verdict.frame = frame;
          verdict.witness.particles = {i};
          verdict.witness.text = fmt::format("{} of particle {} in frame {} is not finite", name, i, frame);
        }
      }
    }
  }
  if (verdict.checked == 0) verdict.vacuous = "no numbers";
  return verdict;
}

// The particle that is off by most, of so many that exist.
struct Farthest {
  int32_t particle = -1;
  double distance = 0;  // [m]
  int64_t among = 0;
};

struct Differences {
  Differences(const KickedRuns& of_runs, const std::vector<double>& within)
      : runs(of_runs), bounds(within), plain(runs, runs.positions), kicked(runs, runs.kicked) {}
  const KickedRuns& runs;
  const std::vector<double>& bounds;
  const Run plain, kicked;

  double of(int64_t frame, int32_t i) const { return distance(plain, kicked, frame, i); }
  // Among the particles whose piece `counts`.
  template <class Counts>
  Farthest farthest(int64_t frame, const Counts& counts) const {
    Farthest found;
    for (int32_t i = 0; i < runs.particles; ++i) {
      if (!counts(runs.piece[at(i)]) || !(plain.exists(frame, i) || kicked.exists(frame, i))) continue;
      ++found.among;
      if (const double off = of(frame, i); found.particle < 0 || off > found.distance) {
        found.particle = i;
        found.distance = off;
      }
    }
    return found;
  }
};

std::string in_spacings(const KickedRuns& runs, double length) {
  return runs.spacing > 0 ? fmt::format("{:.3g} m ({:.3g} h)", length, length / runs.spacing)
                          : fmt::format("{:.3g} m", length);
}

void look_at_pieces(const Differences& differences, KickReport& report) {
  const KickedRuns& runs = differences.runs;
  std::map<int32_t, KickedPiece> pieces;
  for (int32_t i = 0; i < runs.particles; ++i) {
    KickedPiece& piece = pieces[runs.piece[at(i)]];
    piece.piece = runs.piece[at(i)];
    ++piece.particles;
    bool felt = false;
    for (int64_t f = 0; f < runs.frames; ++f) {
      const double off = differences.of(f, i);
      piece.greatest = std::max(piece.greatest, off);
      if (off <= differences.bounds[at(f)]) continue;
      if (piece.first_frame < 0 || f < piece.first_frame) piece.first_frame = f;
      felt = true;
    }
    piece.felt += felt ? 1 : 0;
  }
  for (const auto& [name, piece] : pieces) report.pieces.push_back(piece);
}

// The piece that moves otherwise first; of several the one that is off by most.
void find_kicked_piece(const Differences& differences, KickReport& report) {
  const KickedRuns& runs = differences.runs;
  report.kicked_piece = runs.kicked_piece;
  for (int64_t f = 0; f < runs.frames; ++f) {
    const Farthest farthest =
        differences.farthest(f, [&](int32_t piece) { return !runs.kicked_piece || piece == *runs.kicked_piece; });
    if (farthest.particle < 0 || farthest.distance <= differences.bounds[at(f)]) continue;
    report.kicked_piece = runs.piece[at(farthest.particle)];
    report.kick_frame = f;
    return;
  }
}

Verdict the_kick_was_felt(const KickedRuns& runs, const KickReport& report) {
  Verdict verdict = kick_verdict("the kick was felt", "oracles.md, A kick", "m");
  verdict.checked = runs.particles;
  verdict.frame = std::max<int64_t>(report.kick_frame, 0);
  for (const KickedPiece& piece : report.pieces) {
    if (!report.kicked_piece || piece.piece == *report.kicked_piece) {
      verdict.measured = std::max(verdict.measured, piece.greatest);
    }
  }
  verdict.holds = report.kick_frame >= 0;
  if (verdict.holds) {
    verdict.bound = verdict.measured;  // more is no worse
    return verdict;
  }
  const std::string who = runs.kicked_piece ? fmt::format("piece {}", *runs.kicked_piece) : "no piece";
  const char* const what = runs.kicked_piece ? "did not move otherwise" : "moved otherwise";
  verdict.witness.text = fmt::format(
      "nothing was tested: {} {} when it was kicked{}", who, what,
      report.repeats
          ? ""
          : fmt::format(
                ", by more than the simulator's own noise explains, in the {} of {} frames of which its noise is "
                "known: kick harder, write longer runs, or make it repeat itself",
                report.judged_frames, runs.frames));
  return verdict;
}

Verdict others_feel_nothing(const Differences& differences, KickReport& report) {
  const KickedRuns& runs = differences.runs;
  Verdict verdict = kick_verdict(
      "no ghost force",
      report.repeats ? "oracles.md, A kick: the same numbers" : "tolerances.md, A kick in a noisy simulator", "m");
  const int32_t kicked = *report.kicked_piece;
  const auto is_other = [&](int32_t piece) { return piece != kicked; };
  double share = -1;
  for (int64_t f = 0; f < runs.frames; ++f) {
    const Farthest farthest = differences.farthest(f, is_other);
    const double bound = differences.bounds[at(f)];
    verdict.checked += farthest.among;
    if (!std::isfinite(bound)) verdict.undecided += farthest.among;
    if (farthest.particle < 0 || !std::isfinite(bound)) continue;
    if (f >= report.kick_frame && (report.sharpest_frame < 0 || bound < report.least_bound)) {
      report.least_bound = bound;
      report.sharpest_frame = f;
      report.kick_then = differences.farthest(f, [&](int32_t piece) { return piece == kicked; }).distance;
    }
    if (farthest.distance > bound) {
      if (!verdict.holds) continue;  // the first one counts
      verdict.holds = false;
      verdict.frame = f;
      verdict.measured = farthest.distance;
      verdict.bound = bound;
      const int32_t piece = runs.piece[at(farthest.particle)];
      verdict.witness.particles = {farthest.particle};
      const std::string by = std::isfinite(farthest.distance) ? "by " + in_spacings(runs, farthest.distance)
                                                              : "which is there in one of the runs alone";
      verdict.witness.text = fmt::format(
          "particle {} of piece {} felt it first, from frame {} on, {}, because piece {} was kicked, to which it is "
          "not connected",
          farthest.particle, piece, f, by, kicked);
    } else if (const double of_bound = farthest.distance > 0 ? farthest.distance / bound : 0;
               verdict.holds && of_bound > share) {
      share = of_bound;
      verdict.frame = f;
      verdict.measured = farthest.distance;
      verdict.bound = bound;
    }
  }
  for (const KickedPiece& piece : report.pieces) {
    if (piece.piece == kicked || piece.felt == 0) continue;
    verdict.witness.text +=
        fmt::format("; {} of {} particles of piece {} did", piece.felt, piece.particles, piece.piece);
  }
  if (verdict.checked == 0) verdict.vacuous = "there is no other piece, or nothing of one exists";
  return verdict;
}

}  // namespace

bool KickReport::holds() const {
  return std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& verdict) { return verdict.holds; });
}

std::vector<double> noise_bounds(const KickedRuns& runs) {
  std::vector<double> noise(at(runs.frames), 0.0), bounds(at(runs.frames), 0.0);
  int64_t first = -1;  // frame with noise
  double extent = 0;
  if (runs.again.empty()) return bounds;
  const Run plain(runs, runs.positions), again(runs, runs.again);
  for (int64_t f = 0; f < runs.frames; ++f) {
    noise[at(f)] = f > 0 ? noise[at(f - 1)] : 0;
    for (int32_t i = 0; i < runs.particles; ++i) {
      noise[at(f)] = std::max(noise[at(f)], distance(plain, again, f, i));
      if (!plain.exists(f, i)) continue;
      for (int axis = 0; axis < 3; ++axis) extent = std::max(extent, std::abs(plain.at_frame(f, i)[axis]));
    }
    if (first < 0 && noise[at(f)] > 0) first = f;
  }
  if (first < 0) return bounds;
  const double rounding = std::sqrt(3.0) * unit_roundoff(runs.precision) * extent;
  for (int64_t f = 0; f < runs.frames; ++f) {
    // Chance may begin at once in one run and late in another. How far it would have grown by then nobody has seen.
    bounds[at(f)] = first + f < runs.frames ? kNoiseFactor * std::max(noise[at(first + f)], rounding) : INFINITY;
  }
  return bounds;
}

KickReport judge_kick(const KickedRuns& runs) {
  KickReport report;
  report.kicked_piece = runs.kicked_piece;
  report.verdicts.push_back(check_numbers(runs));
  if (!report.verdicts.back().holds) return report;
  const std::vector<double> bounds = noise_bounds(runs);
  report.judged_frames = std::count_if(bounds.begin(), bounds.end(), [](double bound) { return std::isfinite(bound); });
  report.repeats = std::all_of(bounds.begin(), bounds.end(), [](double bound) { return bound == 0; });
  const Differences differences(runs, bounds);
  look_at_pieces(differences, report);
  find_kicked_piece(differences, report);
  report.verdicts.push_back(the_kick_was_felt(runs, report));
  if (report.kick_frame < 0) return report;

  Verdict judged = kick_verdict("something was judged", "oracles.md, A kick", "1");
  judged.measured = static_cast<double>(report.pieces.size());
  judged.bound = 2;
  judged.checked = 1;
  judged.holds = report.pieces.size() > 1;
  if (!judged.holds) judged.witness.text = "there is a single piece, and nobody else who could feel anything";
  report.verdicts.push_back(std::move(judged));
  report.verdicts.push_back(others_feel_nothing(differences, report));
  return report;
}

}  // namespace cutproof::oracles
