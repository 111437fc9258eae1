#include "oracles/relations/kick.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <ranges>
#include <set>
#include <utility>

#include "model/at.h"
#include "oracles/rounding.h"

namespace cutproof::oracles {

namespace {

// The greatest share of a kick that a solver or a time step of all pieces explains, in another piece or between equal
// answers: beyond, it would not have converged.
constexpr double kOfASolver = 1e-2;

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

// Which of several.
std::string of_kick(const KickedRuns& runs, std::size_t kick) {
  return runs.kicks.size() > 1 ? fmt::format(" (kick {})", kick) : "";
}

Verdict check_numbers(const KickedRuns& runs) {
  Verdict verdict = kick_verdict("finite", "oracles.md, A kick", "1");
  std::vector<std::pair<std::string, const std::vector<double>*>> all = {{"positions", &runs.positions}};
  for (std::size_t k = 0; k < runs.kicks.size(); ++k) {
    all.emplace_back("kicked" + of_kick(runs, k), &runs.kicks[k].positions);
  }
  all.emplace_back("again", &runs.again);
  for (const auto& [name, positions] : all) {
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

// How far the farthest coordinate is from 0 [m].
double extent_of(const Run& run, const KickedRuns& runs) {
  double extent = 0;
  for (int64_t f = 0; f < runs.frames; ++f) {
    for (int32_t i = 0; i < runs.particles; ++i) {
      if (!run.exists(f, i)) continue;
      for (int axis = 0; axis < 3; ++axis) extent = std::max(extent, std::abs(run.at_frame(f, i)[axis]));
    }
  }
  return extent;
}

// By how much positions of two runs of one start may differ that nothing but the simulator's own noise tells apart,
// frame by frame [m] (tolerances.md, A kick in a noisy simulator). All 0 if it repeats itself; infinite where it is not
// known.
std::vector<double> noise_bounds(const KickedRuns& runs) {
  std::vector<double> noise(at(runs.frames), 0.0), bounds(at(runs.frames), 0.0);
  int64_t first = -1;  // frame with noise
  if (runs.again.empty()) return bounds;
  const Run plain(runs, runs.positions), again(runs, runs.again);
  for (int64_t f = 0; f < runs.frames; ++f) {
    noise[at(f)] = f > 0 ? noise[at(f - 1)] : 0;
    for (int32_t i = 0; i < runs.particles; ++i) noise[at(f)] = std::max(noise[at(f)], distance(plain, again, f, i));
    if (first < 0 && noise[at(f)] > 0) first = f;
  }
  if (first < 0) return bounds;
  const double rounding = std::sqrt(3.0) * unit_roundoff(runs.precision) * extent_of(plain, runs);
  for (int64_t f = 0; f < runs.frames; ++f) {
    // Chance may begin at once in one run and late in another. How far it would have grown by then nobody has seen.
    bounds[at(f)] = first + f < runs.frames ? kNoiseFactor * std::max(noise[at(first + f)], rounding) : INFINITY;
  }
  return bounds;
}

// A run and the same run with one kick.
struct Differences {
  Differences(const KickedRuns& of_runs, std::size_t of_kick, const std::vector<double>& within)
      : runs(of_runs),
        kick(runs.kicks[of_kick]),
        which(oracles::of_kick(runs, of_kick)),
        noise(within),
        plain(runs, runs.positions),
        kicked(runs, kick.positions) {}
  const KickedRuns& runs;
  const KickedRun& kick;
  const std::string which;
  const std::vector<double>& noise;
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

// How the kicked piece's centre of mass answers.
struct CentreAnswer {
  std::vector<Vec3> moved;         // [frames] [m]
  std::vector<double> resolution;  // [frames] what rounding and noise explain [m]; infinite where noise is not known
};

double mass_of(const KickedRuns& runs, int32_t particle) { return runs.mass.empty() ? 1 : runs.mass[at(particle)]; }

// tolerances.md, The answer to a kick.
std::vector<double> resolution_of(const Differences& differences, const KickAnswer& answer) {
  const KickedRuns& runs = differences.runs;
  double squares = 0, total = 0;
  for (int32_t i = 0; i < runs.particles; ++i) {
    if (runs.piece[at(i)] != *answer.kicked_piece) continue;
    squares += mass_of(runs, i) * mass_of(runs, i);
    total += mass_of(runs, i);
  }
  const double rounding =
      unit_roundoff(runs.precision) * std::max(extent_of(differences.plain, runs), extent_of(differences.kicked, runs));
  std::vector<double> resolution = differences.noise;
  for (int64_t f = answer.kick_frame; f < runs.frames; ++f) {
    const double substeps = static_cast<double>(runs.steps) * static_cast<double>(f - answer.kick_frame + 1);
    const double places = 4 * std::sqrt(3.0) * substeps;
    const double forces =
        kDeviations * std::sqrt(2.0 / 3.0) * kStableForces * std::pow(substeps, 1.5) * std::sqrt(squares) / total;
    resolution[at(f)] += rounding * (places + forces);
  }
  return resolution;
}

std::string in_spacings(const KickedRuns& runs, double length) {
  return runs.spacing > 0 ? fmt::format("{:.3g} m ({:.3g} h)", length, length / runs.spacing)
                          : fmt::format("{:.3g} m", length);
}

// What others may feel, by frame [m]: noise, and the tolerated share of how far the kicked piece has been off by then.
std::vector<double> felt_bounds(const Differences& differences, std::optional<int32_t> kicked) {
  const KickedRuns& runs = differences.runs;
  std::vector<double> bounds = differences.noise;
  double off = 0;
  for (int64_t f = 0; f < runs.frames; ++f) {
    for (int32_t i = 0; i < runs.particles; ++i) {
      if (runs.piece[at(i)] != kicked) continue;
      if (const double d = differences.of(f, i); std::isfinite(d)) off = std::max(off, d);
    }
    bounds[at(f)] += runs.tolerance * off;
  }
  return bounds;
}

// Of the particles of a piece that exist in both runs. In more digits than its terms have: it may be a large piece.
struct CentreSum {
  std::array<long double, 3> moments = {};
  long double mass = 0;
  void add(double weight, const double* from, const double* to) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      moments[axis] += weight * (static_cast<long double>(to[axis]) - from[axis]);
    }
    mass += weight;
  }
  Vec3 moved() const {
    const auto mean = [&](std::size_t axis) { return static_cast<double>(mass > 0 ? moments[axis] / mass : 0); };
    return {mean(0), mean(1), mean(2)};
  }
};

// How the centre of the kicked piece moved, by frame [m].
std::vector<Vec3> look_at_pieces(const Differences& differences, const std::vector<double>& bounds,
                                 KickAnswer& answer) {
  const KickedRuns& runs = differences.runs;
  std::map<int32_t, std::size_t> index;  // of a piece among all
  for (const int32_t name : runs.piece) index[name] = 0;
  for (auto& [name, place] : index) {
    place = answer.pieces.size();
    answer.pieces.push_back({name});
  }
  std::vector<std::size_t> piece_of;
  for (const int32_t name : runs.piece) {
    piece_of.push_back(index[name]);
    ++answer.pieces[piece_of.back()].particles;
  }
  std::vector<bool> felt(at(runs.particles), false);
  std::vector<Vec3> moved;
  double kick = 0;  // how far a particle of the kicked piece was off that exists in both runs [m]
  for (int64_t f = 0; f < runs.frames; ++f) {
    std::vector<CentreSum> centres(answer.pieces.size());
    for (int32_t i = 0; i < runs.particles; ++i) {
      KickedPiece& piece = answer.pieces[piece_of[at(i)]];
      const double off = differences.of(f, i);
      piece.greatest = std::max(piece.greatest, off);
      if (piece.piece == answer.kicked_piece && std::isfinite(off)) kick = std::max(kick, off);
      if (differences.plain.exists(f, i) && differences.kicked.exists(f, i)) {
        centres[piece_of[at(i)]].add(mass_of(runs, i), differences.plain.at_frame(f, i),
                                     differences.kicked.at_frame(f, i));
      }
      if (off <= bounds[at(f)]) continue;
      if (piece.first_frame < 0) piece.first_frame = f;
      felt[at(i)] = true;
    }
    for (std::size_t k = 0; k < centres.size(); ++k) {
      answer.pieces[k].centre = std::max(answer.pieces[k].centre, norm(centres[k].moved()));
      if (answer.pieces[k].piece == answer.kicked_piece) moved.push_back(centres[k].moved());
    }
  }
  for (int32_t i = 0; i < runs.particles; ++i) answer.pieces[piece_of[at(i)]].felt += felt[at(i)] ? 1 : 0;
  for (KickedPiece& piece : answer.pieces) piece.of_kick = piece.greatest > 0 ? piece.greatest / kick : 0;
  return moved;
}

// The piece that moves otherwise first; of several the one that is off by most.
void find_kicked_piece(const Differences& differences, KickAnswer& answer) {
  const KickedRuns& runs = differences.runs;
  answer.kicked_piece = differences.kick.piece;
  for (int64_t f = 0; f < runs.frames; ++f) {
    const Farthest farthest = differences.farthest(
        f, [&](int32_t piece) { return !differences.kick.piece || piece == *differences.kick.piece; });
    if (farthest.particle < 0 || farthest.distance <= differences.noise[at(f)]) continue;
    answer.kicked_piece = runs.piece[at(farthest.particle)];
    answer.kick_frame = f;
    return;
  }
}

Verdict the_kick_was_felt(const Differences& differences, const KickReport& report, const KickAnswer& answer) {
  const KickedRuns& runs = differences.runs;
  Verdict verdict = kick_verdict("the kick was felt", "oracles.md, A kick", "m");
  verdict.checked = runs.particles;
  verdict.frame = std::max<int64_t>(answer.kick_frame, 0);
  for (const KickedPiece& piece : answer.pieces) {
    if (!answer.kicked_piece || piece.piece == *answer.kicked_piece) {
      verdict.measured = std::max(verdict.measured, piece.greatest);
    }
  }
  verdict.holds = answer.kick_frame >= 0;
  if (verdict.holds) {
    verdict.bound = verdict.measured;  // more is no worse
    return verdict;
  }
  const std::optional<int32_t> named = differences.kick.piece;
  const std::string who = named ? fmt::format("piece {}", *named) : "no piece";
  const char* const what = named ? "did not move otherwise" : "moved otherwise";
  verdict.witness.text = fmt::format(
      "nothing was tested: {} {} when it was kicked{}{}", who, what, differences.which,
      report.repeats
          ? ""
          : fmt::format(
                ", by more than the simulator's own noise explains, in the {} of {} frames of which its noise is "
                "known: kick harder, write longer runs, or make it repeat itself",
                report.judged_frames, runs.frames));
  return verdict;
}

// A body that is pushed as a whole yields, held or not: at first its centre goes to the side to which it was pushed.
Verdict answer_follows(const Differences& differences, const KickAnswer& answer, const CentreAnswer& centre) {
  Verdict verdict = kick_verdict("the answer follows the kick", "tolerances.md, The answer to a kick", "degrees");
  verdict.checked = 1;
  verdict.bound = 90;
  const Vec3 direction = normalized(*differences.kick.direction);
  const std::string who = fmt::format("the centre of piece {}{}", *answer.kicked_piece, differences.which);
  double across = 0;
  for (int64_t f = answer.kick_frame; f < differences.runs.frames; ++f) {
    const Vec3 moved = centre.moved[at(f)];
    const double way = norm(moved), along = dot(moved, direction), resolution = centre.resolution[at(f)];
    if (way > resolution && way > across) {
      across = way;
      verdict.frame = f;
    }
    if (!(std::abs(along) > resolution)) continue;
    verdict.frame = f;
    verdict.measured = std::acos(std::clamp(along / way, -1.0, 1.0)) * 180 / M_PI;
    verdict.holds = along > 0;
    if (!verdict.holds) {
      verdict.witness.text =
          fmt::format("{} moves against the kick: in frame {} by {}, {:.3g} degrees from its direction", who, f,
                      in_spacings(differences.runs, way), verdict.measured);
    }
    return verdict;
  }
  verdict.holds = false;
  verdict.measured = 90;
  verdict.witness.text =
      across > 0 ? fmt::format("{} moves across the kick: in frame {} by {}, and never along it", who, verdict.frame,
                               in_spacings(differences.runs, across))
                 : fmt::format("{}: {} moves by no more than rounding and noise explain; kick harder", kNotJudged, who);
  return verdict;
}

// What explains a push that is far less than the kick, and that more than every other particle feels.
std::string likely_cause(const KickedRuns& runs, const KickAnswer& answer) {
  double share = 0;
  int64_t felt = 0, others = 0;
  for (const KickedPiece& piece : answer.pieces) {
    if (piece.piece == *answer.kicked_piece) continue;
    share = std::max(share, piece.of_kick);
    felt += piece.felt;
    others += piece.particles;
  }
  if (!std::isfinite(share)) return "";
  if (share > kOfASolver || 2 * felt <= others) return fmt::format("; by {:.2g} of the kick at most", share);
  return fmt::format(
             ". The cause is global coupling, {:.2g} of the kick, as by a solver or a time step that all pieces "
             "share. ",
             share) +
         (runs.tolerance > 0 ? fmt::format("The declared tolerance is {:g}", runs.tolerance)
                             : "If it is meant, declare a tolerance (the array `tolerance`)");
}

Verdict others_feel_nothing(const Differences& differences, const std::vector<double>& bounds, bool repeats,
                            KickAnswer& answer) {
  const KickedRuns& runs = differences.runs;
  Verdict verdict = kick_verdict("no ghost force",
                                 !repeats             ? "tolerances.md, A kick in a noisy simulator"
                                 : runs.tolerance > 0 ? "tolerances.md, The answer to a kick"
                                                      : "oracles.md, A kick: the same numbers",
                                 "m");
  const int32_t kicked = *answer.kicked_piece;
  const auto is_other = [&](int32_t piece) { return piece != kicked; };
  double share = -1;
  for (int64_t f = 0; f < runs.frames; ++f) {
    const Farthest farthest = differences.farthest(f, is_other);
    const double bound = bounds[at(f)];
    verdict.checked += farthest.among;
    if (!std::isfinite(bound)) verdict.inconclusive += farthest.among;
    if (farthest.particle < 0 || !std::isfinite(bound)) continue;
    if (f >= answer.kick_frame && (answer.sharpest_frame < 0 || bound < answer.least_bound)) {
      answer.least_bound = bound;
      answer.sharpest_frame = f;
      answer.kick_then = differences.farthest(f, [&](int32_t piece) { return piece == kicked; }).distance;
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
      verdict.witness.text =
          fmt::format("Particle {} of piece {} felt it first, from frame {} on, {}", farthest.particle, piece, f, by);
    } else if (const double of_bound = farthest.distance > 0 ? farthest.distance / bound : 0;
               verdict.holds && of_bound > share) {
      share = of_bound;
      verdict.frame = f;
      verdict.measured = farthest.distance;
      verdict.bound = bound;
    }
  }
  if (!verdict.holds) {
    std::vector<std::string> felt;
    for (const KickedPiece& piece : answer.pieces) {
      if (piece.piece != kicked && piece.felt > 0)
        felt.push_back(fmt::format("{} of {} particles of piece {}", piece.felt, piece.particles, piece.piece));
    }
    verdict.witness.text = fmt::format("{} move because piece {} was kicked{}, to which they are not connected. ",
                                       fmt::join(felt, ", "), kicked, differences.which) +
                           verdict.witness.text + likely_cause(runs, answer);
  }
  if (verdict.checked == 0) verdict.vacuous = "there is no other piece, or nothing of one exists";
  return verdict;
}

// `centre`: filled in where the kick was felt.
KickAnswer judge_one(const Differences& differences, const KickReport& report, CentreAnswer& centre) {
  KickAnswer answer;
  find_kicked_piece(differences, answer);
  const std::vector<double> bounds = felt_bounds(differences, answer.kicked_piece);
  centre.moved = look_at_pieces(differences, bounds, answer);
  answer.verdicts.push_back(the_kick_was_felt(differences, report, answer));
  if (answer.kick_frame < 0) return answer;
  centre.resolution = resolution_of(differences, answer);
  if (differences.kick.direction) answer.verdicts.push_back(answer_follows(differences, answer, centre));
  answer.verdicts.push_back(others_feel_nothing(differences, bounds, report.repeats, answer));
  return answer;
}

Verdict something_was_judged(const KickedRuns& runs) {
  Verdict verdict = kick_verdict("something was judged", "oracles.md, A kick", "1");
  verdict.holds = std::set<int32_t>(runs.piece.begin(), runs.piece.end()).size() > 1;
  verdict.measured = verdict.holds ? 0 : 1;
  verdict.checked = 1;
  if (!verdict.holds) verdict.witness.text = "there is a single piece, and nobody else who could feel anything";
  return verdict;
}

// Of kicks that symmetry makes equal: centres are moved equally far in every frame.
Verdict answers_are_equal(const KickedRuns& runs, const std::map<std::size_t, CentreAnswer>& kicks,
                          const KickReport& report) {
  Verdict verdict = kick_verdict("equal answers", "tolerances.md, The answer to a kick", "1");
  double share = -1;
  int64_t first = runs.frames;
  for (const auto& [k, centre] : kicks) first = std::min(first, report.kicks[k].kick_frame);
  for (int64_t f = first; f < runs.frames; ++f) {
    std::size_t least = kicks.begin()->first, most = least;
    double resolution = 0;
    const auto way = [&](std::size_t k) { return norm(kicks.at(k).moved[at(f)]); };
    for (const auto& [k, centre] : kicks) {
      if (way(k) < way(least)) least = k;
      if (way(k) > way(most)) most = k;
      resolution = std::max(resolution, centre.resolution[at(f)]);
    }
    const double bound = 2 * resolution + runs.tolerance * way(most);
    if (!(bound < way(most))) {  // no answer at all would be within it
      ++verdict.inconclusive;
      continue;
    }
    ++verdict.checked;
    const double measured = (way(most) - way(least)) / way(most), within = bound / way(most);
    const bool holds = measured <= within;
    if (!verdict.holds || (holds && measured / within <= share)) continue;
    share = measured / within;
    verdict.holds = holds;
    verdict.frame = f;
    verdict.measured = measured;
    verdict.bound = within;
    if (holds) continue;
    const auto who = [&](std::size_t k) {
      return fmt::format("kick {} moves the centre of piece {} by {:.4g} m", k, *report.kicks[k].kicked_piece, way(k));
    };
    verdict.witness.text =
        fmt::format("the answers to kicks that are stated to be equal differ by {:.3g} %: in frame {} {}, and {}",
                    100 * measured, f, who(most), who(least));
    if (measured < kOfASolver) verdict.witness.text += ". If so small a difference is expected, declare a tolerance";
  }
  if (verdict.checked == 0) {
    verdict.holds = false;
    verdict.witness.text = fmt::format(
        "{}: rounding and noise may be as large as the answers of kicks {}; kick harder, or write earlier frames",
        kNotJudged, fmt::join(std::views::keys(kicks), ", "));
  }
  return verdict;
}

}  // namespace

std::vector<Verdict> KickReport::all() const {
  std::vector<Verdict> all = verdicts;
  for (const KickAnswer& kick : kicks) all.insert(all.end(), kick.verdicts.begin(), kick.verdicts.end());
  std::stable_partition(all.begin(), all.end(), [](const Verdict& one) { return one.property != "equal answers"; });
  return all;
}

bool KickReport::holds() const {
  const std::vector<Verdict> found = all();
  return std::all_of(found.begin(), found.end(), [](const Verdict& verdict) { return verdict.holds; });
}

KickReport judge_kick(const KickedRuns& runs) {
  KickReport report;
  report.verdicts.push_back(check_numbers(runs));
  if (!report.verdicts.back().holds) return report;
  report.verdicts.push_back(something_was_judged(runs));
  const std::vector<double> noise = noise_bounds(runs);
  report.judged_frames = std::count_if(noise.begin(), noise.end(), [](double bound) { return std::isfinite(bound); });
  report.repeats = std::all_of(noise.begin(), noise.end(), [](double bound) { return bound == 0; });
  std::map<int32_t, std::map<std::size_t, CentreAnswer>> groups;
  std::set<int32_t> not_felt;
  for (std::size_t k = 0; k < runs.kicks.size(); ++k) {
    const Differences differences(runs, k, noise);
    CentreAnswer centre;
    const KickAnswer& answer = report.kicks.emplace_back(judge_one(differences, report, centre));
    const int32_t group = runs.kicks[k].equal;
    if (group < 0) continue;
    if (answer.kick_frame < 0) {
      not_felt.insert(group);
    } else {
      groups[group].emplace(k, std::move(centre));
    }
  }
  for (const auto& [group, kicks] : groups) {
    if (not_felt.count(group) == 0) report.verdicts.push_back(answers_are_equal(runs, kicks, report));
  }
  return report;
}

}  // namespace cutproof::oracles
