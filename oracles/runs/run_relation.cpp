#include "oracles/runs/run_relation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/at.h"
#include "oracles/rounding.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

constexpr const char* kSource = "tolerances.md, Relations between runs";
// Relative, in units of u: inputs that were computed, such as masses summed over cells.
constexpr double kInputRounds = 256;
enum Which : std::size_t {
  kInputs,
  kFrames,
  kExistence,
  kPositions,
  kVelocities,
  kSpin,
  kImpulse,
  kEnergy,
  kCoupling,
  kBits,
  kNoise,
  kJudged,
  kProperties
};
// `needs`: what both runs have to have so that it is asked; null: it is asked, or the user has not.
struct Property {
  const char *name, *unit, *needs;
};
constexpr Property kNames[kProperties] = {
    {"related inputs", "1", nullptr},
    {"related frames", "1", nullptr},
    {"related existence", "1", nullptr},
    {"related positions", "m", nullptr},
    {"related velocities", "m/s", "needs velocities, and time or --noise"},
    {"related spin", "kg m²/s", "needs spin and --noise"},
    {"related contact impulse", "kg m/s", "needs contact_impulse and --noise"},
    {"related energy", "J", "needs energy and --noise, and no boost"},
    {"related coupling", "1", "needs coupling groups or cells"},
    {"same bits", "1", nullptr},
    {"noise is there", "1", nullptr},
    {"something was judged", "m", nullptr},
};

Verdict fresh(Which which) {
  Verdict verdict;
  verdict.property = kNames[which].name;
  verdict.unit = kNames[which].unit;
  verdict.bound_source = kSource;
  return verdict;
}

// Infinite where one of the two is no number.
double distance(Vec3 a, Vec3 b) {
  const double length = std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
  return std::isnan(length) ? std::numeric_limits<double>::infinity() : length;
}
bool same_bits(Vec3 a, Vec3 b) { return a == b || (is_blank(a) && is_blank(b)); }

// How far positions of two runs differ after n substeps by what each rounds, carried on by velocities and grown by
// nothing, in units of u times the farthest place.
double carried_roundings(double n) { return kDeviations * (kStableForces * n * std::sqrt(n / 3) + std::sqrt(n)); }

// Groups and cells as sets of particles, in an order that nobody chose. Requires members that `renamed` knows.
std::vector<std::vector<int32_t>> sets_of(const RunCoupling& coupling, const std::vector<int32_t>& renamed) {
  std::vector<std::vector<int32_t>> sets;
  const auto add = [&](auto begin, auto end) {
    std::vector<int32_t> members(begin, end);
    for (int32_t& i : members) i = i >= 0 && i < std::ssize(renamed) ? renamed[at(i)] : i;
    std::sort(members.begin(), members.end());
    sets.push_back(std::move(members));
  };
  for (std::size_t g = 0; g + 1 < coupling.offsets.size(); ++g) {
    const int64_t begin = coupling.offsets[g], end = coupling.offsets[g + 1];
    if (begin < 0 || begin > end || end > std::ssize(coupling.members)) continue;  // `check` says what is wrong
    add(coupling.members.begin() + begin, coupling.members.begin() + end);
  }
  for (std::size_t c = 0; coupling.corners > 0 && c < coupling.cells.size(); c += at(coupling.corners)) {
    add(coupling.cells.begin() + static_cast<std::ptrdiff_t>(c),
        coupling.cells.begin() + static_cast<std::ptrdiff_t>(c) + coupling.corners);
  }
  std::sort(sets.begin(), sets.end());
  return sets;
}

}  // namespace

class RunRelation::Implementation {
 public:
  Implementation(RunMap map, RunHeader a, RunHeader b, int noise_runs, bool bits)
      : map_(std::move(map)), a_(std::move(a)), b_(std::move(b)), noise_runs_(noise_runs), bits_(bits) {
    for (std::size_t k = 0; k < kProperties; ++k) found_.push_back({fresh(static_cast<Which>(k))});
    u_ = std::max(a_.u, b_.u);
  }

  void permute(std::vector<int32_t> permutation) { permutation_ = std::move(permutation); }

  void weigh(std::vector<double> a, std::vector<double> b) {
    if (!permutation_.empty() && permutation_.size() == b.size()) b = in_a(std::span<const double>(b));
    compare_inputs("mass", std::span<const double>(a), std::span<const double>(b), {0, 0, 1});
  }

  void see(const RelatedRun& a, const RelatedRun& b, std::span<const RelatedRun> noise) {
    frame_ = a.frame.index;
    ++frames_;
    if (a.frame.positions.size() != b.frame.positions.size()) {
      return fail(kFrames, {}, "frame {} has {} particles in the first run and {} in the second", frame_,
                  a.frame.positions.size(), b.frame.positions.size());
    }
    if (!permutation_.empty() && permutation_.size() != a.frame.positions.size()) {
      return fail(kFrames, {}, "frame {} has {} particles, and permutation names {}", frame_, a.frame.positions.size(),
                  permutation_.size());
    }
    ++found_[kFrames].verdict.checked;
    if (frames_ == 1) begin(a.frame);
    if (a.frame.time) {
      if (!time_at_first_) time_at_first_ = a.frame.time;
      substep_ = (*a.frame.time - *time_at_first_) / std::max(1.0, static_cast<double>(frames_ - 1) * steps());
    }
    compare_times(a.frame, b.frame);
    compare_inputs("blade", a.frame.blade, b.frame.blade, Follows::point, {1, 0, 0}, a.frame.time.value_or(0));
    find_existing(a.frame, b.frame, noise);
    for (std::size_t i = 0; i < both_.size(); ++i) {
      if (both_[i] == 0) continue;
      const Vec3 x = a.frame.positions[i];
      extent_ = std::max({extent_, norm(x), norm(b.frame.positions[at(in_b(i))]) / length()});
      if (i < first_.size()) moved_ = std::max(moved_, distance(x, first_[i]));
    }
    vectors(kPositions, &RunFrame::positions, Follows::point, {1, 0, 0}, a.frame, b.frame, noise);
    vectors(kVelocities, &RunFrame::velocities, Follows::velocity, {1, -1, 0}, a.frame, b.frame, noise);
    vectors(kSpin, &RunFrame::spin, Follows::axial, {2, -1, 1}, a.frame, b.frame, noise);
    totals(a.frame, b.frame, noise);
    if (a.is_new_coupling || b.is_new_coupling) {
      couplings(a, b, noise);
    } else if (Found& found = found_[kCoupling]; found.frames > 0 && !may_branch_) {
      ++found.frames;
      found.failing += is_coupled_otherwise_;
    }
  }

  void see_end_of_some(int64_t frame) {
    frame_ = frame;
    fail(kFrames, {}, "a run ends after {} frames, and another one goes on", frame);
  }

  void finish() {
    if (frames_ == 0) fail(kFrames, {}, "there is no frame that both runs have");
    if (noise_runs_ > 0) {
      Verdict& verdict = found_[kNoise].verdict;
      verdict.checked = noise_runs_;
      if (!(found_[kPositions].noise > 0)) {
        verdict.measured = noise_runs_;
        fail(kNoise, {}, "the disturbed runs have the places of the first one: they were not disturbed");
      }
    }
    Verdict& judged = found_[kJudged].verdict;
    judged.checked = 1;
    judged.measured = sharpest_.bound;
    judged.bound = sharpest_.moved;
    if (holds(kFrames) && sharpest_.frame < 0) {
      fail(kJudged, {}, "{}",
           moved_ > 0 ? "in no frame has a particle moved farther than right runs may be apart"
                      : "no particle moves: nothing was tested");
    }
    if (bits_) {
      Verdict& bits = found_[kBits].verdict;
      bits.checked = frames_;
      if (first_other_) {
        frame_ = first_other_->frame;
        bits.measured = 1;
        fail(kBits, {{}, {first_other_->particle}}, "{}", other_in_words());
      }
    } else {
      notes_.push_back(first_other_ ? other_in_words() : "Both runs have the same bits.");
    }
    for (Found& found : found_) {
      if (found.verdict.holds || found.frames == 0) continue;
      found.verdict.witness.text +=
          fmt::format(". The property fails in {} of {} compared frames", found.failing, found.frames);
    }
    if (lost_ >= 0) {
      notes_.push_back(
          fmt::format("Lost in chaos from frame {} on: right runs may be farther apart there than any "
                      "particle has moved.",
                      lost_));
    }
  }

  std::vector<Verdict> verdicts() const {
    std::vector<Verdict> all;
    for (const Found& found : found_) {
      if (found.verdict.checked > 0 || !found.verdict.holds) all.push_back(found.verdict);
    }
    return all;
  }
  std::vector<RunJudge::NotAsked> not_asked() const {
    std::vector<RunJudge::NotAsked> all;
    for (std::size_t k = 0; k < kProperties; ++k) {
      if (kNames[k].needs != nullptr && found_[k].verdict.checked == 0 && found_[k].verdict.holds)
        all.push_back({kNames[k].name, holds(kFrames) ? kNames[k].needs : "the runs have not the same particles"});
    }
    return all;
  }
  const std::vector<std::string>& notes() const { return notes_; }
  RelationSharpness sharpest() const { return sharpest_; }

 private:
  struct Found {
    Verdict verdict;
    double nearest = -1;  // measured / bound
    double noise = 0;     // the greatest so far, in the units of A
    int64_t frames = 0, failing = 0;
  };
  struct Other {
    int64_t frame = 0;
    int32_t particle = 0;
    double by = 0;  // [m]
  };

  bool holds(Which which) const { return found_[which].verdict.holds; }
  template <class... Args>
  void fail(Which which, Concerned concerned, fmt::format_string<Readable<Args>...> text, Args&&... args) {
    Verdict& verdict = found_[which].verdict;
    if (!verdict.holds) return;
    verdict.holds = false;
    verdict.frame = frame_;
    verdict.witness = witness_of<Args...>(std::move(concerned), text, std::forward<Args>(args)...);
  }
  double length() const { return map_.scale({1, 0, 0}); }
  double steps() const { return static_cast<double>(a_.steps); }
  // Numbers of B are divided by it: verdicts tell distances in the units of A.
  double scale(Dimension of) const { return map_.scale(of); }

  // The particle of B that particle i of A is.
  int32_t in_b(std::size_t i) const { return permutation_.empty() ? static_cast<int32_t>(i) : inverse_[i]; }
  template <class T>
  std::vector<T> in_a(std::span<const T> of_b) const {
    std::vector<T> made(of_b.size());
    for (std::size_t i = 0; i < of_b.size(); ++i) made[at(permutation_[i])] = of_b[i];
    return made;
  }

  void compare_inputs(const char* name, std::span<const double> a, std::span<const double> b, Dimension of) {
    if (a.empty() && b.empty()) return;
    ++found_[kInputs].verdict.checked;
    if (a.size() != b.size())
      return fail(kInputs, {}, "{}: the first run has {}, the second {}", name, a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      const double expected = scale(of) * a[k];
      if (std::abs(b[k] - expected) <= kInputRounds * u_ * std::abs(expected)) continue;
      return fail(kInputs, {},
                  "{} {} is {} in the second run, and the map makes {} of the first: run what "
                  "relate --make writes",
                  name, k, b[k], expected);
    }
  }
  void compare_inputs(const char* name, std::span<const Vec3> a, std::span<const Vec3> b, Follows how, Dimension of,
                      double time) {
    if (a.empty() && b.empty()) return;
    ++found_[kInputs].verdict.checked;
    if (a.size() != b.size())
      return fail(kInputs, {}, "{}: the first run has {}, the second {}", name, a.size(), b.size());
    double greatest = 0;
    for (const Vec3 x : b) greatest = is_blank(x) ? greatest : std::max(greatest, norm(x));
    for (std::size_t k = 0; k < a.size(); ++k) {
      const Vec3 expected = map_.mapped(a[k], how, of, time);
      if (same_bits(b[k], expected) || distance(b[k], expected) <= 4 * u_ * greatest) continue;
      return fail(kInputs, {},
                  "{} {} is ({}, {}, {}) in the second run, and the map makes ({}, {}, {}) of the first: run what "
                  "relate --make writes",
                  name, k, b[k].x, b[k].y, b[k].z, expected.x, expected.y, expected.z);
    }
  }

  void begin(const RunFrame& a) {
    first_.assign(a.positions.begin(), a.positions.end());
    set_inverse(a.positions.size());
    const auto one = [](const double& value) { return std::span<const double>(&value, 1); };
    compare_inputs("spacing", one(a_.spacing), one(b_.spacing), {1, 0, 0});
    compare_inputs("damping", one(a_.damping), one(b_.damping), {0, -1, 0});
    compare_inputs("cut_resolution", one(a_.cut_resolution), one(b_.cut_resolution), {1, 0, 0});
    const Vec3 g = a_.gravity.value_or(Vec3{}), gb = b_.gravity.value_or(Vec3{});
    compare_inputs("gravity", {&g, 1}, {&gb, 1}, Follows::direction, {1, -2, 0}, 0);
    std::vector<Vec3> rest = b_.rest;
    if (!permutation_.empty() && rest.size() == permutation_.size()) rest = in_a(std::span<const Vec3>(b_.rest));
    compare_inputs("rest", a_.rest, rest, Follows::point, {1, 0, 0}, 0);
  }
  void set_inverse(std::size_t n) {
    inverse_.assign(n, 0);
    for (std::size_t i = 0; i < permutation_.size() && i < n; ++i)
      inverse_[at(permutation_[i])] = static_cast<int32_t>(i);
  }

  // A time is a sum of steps since the run began, which rounds differently in other units.
  void compare_times(const RunFrame& a, const RunFrame& b) {
    if (!a.time || !b.time) return;
    ++found_[kInputs].verdict.checked;
    const double expected = scale({0, 1, 0}) * *a.time;
    if (std::abs(*b.time - expected) <= 4 * u_ * static_cast<double>(frame_ + 1) * steps() * std::abs(expected)) return;
    fail(kInputs, {}, "frame {} of the second run is at {} s, and the map makes {} s of the first", frame_, *b.time,
         expected);
  }

  // Whom both runs have; who exists in one alone of A and its disturbed runs is inconclusive.
  void find_existing(const RunFrame& a, const RunFrame& b, std::span<const RelatedRun> noise) {
    const std::size_t n = a.positions.size();
    if (inverse_.size() != n) set_inverse(n);
    both_.assign(n, 0);
    Verdict& verdict = found_[kExistence].verdict;
    for (std::size_t i = 0; i < n; ++i) {
      const bool in_first = exists(a, i), in_second = exists(b, at(in_b(i)));
      const bool is_open = std::any_of(noise.begin(), noise.end(),
                                       [&](const RelatedRun& run) { return exists(run.frame, i) != in_first; });
      ++verdict.checked;
      both_[i] = in_first && in_second && !is_open;
      if (is_open) {
        ++verdict.inconclusive;
        may_branch_ = true;
      } else if (in_first != in_second && !may_branch_) {
        ++verdict.measured;
        fail(kExistence, {{}, {static_cast<int32_t>(i)}},
             "the runs decide differently first in frame {}: particle {} exists in the {} run alone{}", frame_, i,
             in_first ? "first" : "second",
             noise_runs_ > 0 ? "; a branch that no disturbed run took is possible: disturb more" : "");
      }
    }
  }

  // Without disturbed runs: how far right runs differ, in positions [m] or velocities [m/s]; infinite where nothing is
  // known.
  double rounds(Which which) const {
    const double n = std::max(1.0, static_cast<double>(frames_) * steps());
    if (which == kPositions) return u_ * extent_ * carried_roundings(n);
    if (which == kVelocities && substep_ > 0)
      return kDeviations * u_ * (kStableForces + 1) * extent_ / substep_ * std::sqrt(n);
    return std::numeric_limits<double>::infinity();
  }

  // Of one quantity in this frame: the noise so far, and from it how far right runs may be apart.
  double bound_of(Which which, double noise, double greatest) {
    Found& found = found_[which];
    found.noise = std::max(found.noise, noise);
    const double by_map = map_.is_exact() ? 0 : 4 * u_ * greatest;
    return noise_runs_ > 0 ? kNoiseFactor * found.noise + by_map : rounds(which) + by_map;
  }

  // `off`: of each particle; empty of a total.
  void note(Which which, double measured, double bound, int32_t particle, const std::vector<double>& off = {}) {
    Found& found = found_[which];
    ++found.verdict.checked;
    ++found.frames;
    found.failing += !(measured <= bound);
    if (!found.verdict.holds) return;
    const double ratio = measured == 0 ? 0 : measured / bound;
    if (ratio > found.nearest || !(measured <= bound)) {
      found.nearest = ratio;
      found.verdict.measured = measured;
      found.verdict.bound = bound;
      found.verdict.frame = frame_;
    }
    if (measured <= bound) return;
    const std::string explained =
        noise_runs_ > 0
            ? fmt::format("64 times the noise of the disturbed runs explains {:.4g} {}", bound, kNames[which].unit)
            : fmt::format(
                  "Rounding alone explains {:.4g} {}. If contacts amplify rounding, rerun with "
                  "--noise",
                  bound, kNames[which].unit);
    if (particle >= 0) {
      const auto beyond = std::count_if(off.begin(), off.end(), [&](double one) { return !(one <= bound); });
      fail(which, {{}, {particle}}, "{} of {} particles {} off in frame {}, particle {} by most: {:.4g} {}. {}", beyond,
           off.size(), beyond == 1 ? "is" : "are", frame_, particle, measured, kNames[which].unit, explained);
    } else {
      fail(which, {}, "it is off by {:.4g} {} in frame {}. {}", measured, kNames[which].unit, frame_, explained);
    }
  }

  void vectors(Which which, std::span<const Vec3> RunFrame::*member, Follows how, Dimension of, const RunFrame& a,
               const RunFrame& b, std::span<const RelatedRun> noise) {
    const std::span<const Vec3> of_a = a.*member, of_b = b.*member;
    if (of_a.empty() || of_b.empty()) return;
    double noisy = 0, greatest = 0, farthest = 0;
    int32_t who = -1;
    std::vector<double> offs;
    const double unit = scale(of);
    for (std::size_t i = 0; i < both_.size(); ++i) {
      if (both_[i] == 0) continue;
      const Vec3 expected = map_.mapped(of_a[i], how, of, a.time.value_or(0)), got = of_b[at(in_b(i))];
      greatest = std::max(greatest, norm(expected) / unit);
      const double off = offs.emplace_back(distance(expected, got) / unit);
      if (!same_bits(expected, got) && !first_other_) first_other_ = {frame_, static_cast<int32_t>(i), off};
      if (off > farthest || who < 0) farthest = off, who = static_cast<int32_t>(i);
      for (const RelatedRun& run : noise) {
        const std::span<const Vec3> disturbed = run.frame.*member;
        if (!disturbed.empty()) noisy = std::max(noisy, distance(of_a[i], disturbed[i]));
      }
    }
    if (who < 0) return;
    const double bound = bound_of(which, noisy, greatest);
    if (std::isinf(bound)) return;
    note(which, farthest, bound, who, offs);
    if (which != kPositions) return;
    const bool is_lost = bound > moved_;
    if (is_lost && moved_ > 0 && lost_ < 0) lost_ = frame_;
    if (!is_lost) lost_ = -1;
    if (is_lost || moved_ == 0) return;
    if (sharpest_.frame < 0 || bound * sharpest_.moved < sharpest_.bound * moved_) sharpest_ = {frame_, bound, moved_};
  }

  void totals(const RunFrame& a, const RunFrame& b, std::span<const RelatedRun> noise) {
    if (a.contact_impulse && b.contact_impulse && noise_runs_ > 0) {
      double noisy = 0;
      for (const RelatedRun& run : noise)
        noisy = std::max(noisy, distance(*a.contact_impulse, run.frame.contact_impulse.value_or(*a.contact_impulse)));
      const Dimension of = {1, -1, 1};
      const Vec3 expected = map_.mapped(*a.contact_impulse, Follows::direction, of);
      note(kImpulse, distance(expected, *b.contact_impulse) / scale(of),
           bound_of(kImpulse, noisy, norm(*a.contact_impulse)), -1);
    }
    if (a.energy && b.energy && noise_runs_ > 0 && !map_.needs_time()) {
      double noisy = 0;
      for (const RelatedRun& run : noise)
        noisy = std::max(noisy, std::abs(*a.energy - run.frame.energy.value_or(*a.energy)));
      const Dimension of = {2, -2, 1};
      note(kEnergy, std::abs(*b.energy / scale(of) - *a.energy), bound_of(kEnergy, noisy, std::abs(*a.energy)), -1);
    }
  }

  void couplings(const RelatedRun& a, const RelatedRun& b, std::span<const RelatedRun> noise) {
    if (a.coupling == nullptr || b.coupling == nullptr || may_branch_) return;
    Verdict& verdict = found_[kCoupling].verdict;
    const std::vector<std::vector<int32_t>> of_a = sets_of(*a.coupling, {}), of_b = sets_of(*b.coupling, permutation_);
    ++verdict.checked;
    ++found_[kCoupling].frames;
    is_coupled_otherwise_ = of_a != of_b;
    if (!is_coupled_otherwise_) return;
    for (const RelatedRun& run : noise) {
      if (run.coupling == nullptr || sets_of(*run.coupling, {}) == of_a) continue;
      ++verdict.inconclusive;  // rounding decides which groups there are
      may_branch_ = true;
      return;
    }
    const auto [here, there] = std::mismatch(of_a.begin(), of_a.end(), of_b.begin(), of_b.end());
    const bool in_first = there == of_b.end() || (here != of_a.end() && *here < *there);
    ++verdict.measured;
    ++found_[kCoupling].failing;
    fail(kCoupling, {{}, in_first ? *here : *there},
         "the runs decide differently first in frame {}: {} coupling groups and {}. For example, one group of {} "
         "particles is in the {} run alone{}",
         frame_, of_a.size(), of_b.size(), (in_first ? *here : *there).size(), in_first ? "first" : "second",
         noise_runs_ > 0 ? "; a branch that no disturbed run took is possible: disturb more" : "");
  }

  std::string other_in_words() const {
    return fmt::format("The bits differ from frame {} on, first in particle {}, by {:.2g} m or m/s.",
                       first_other_->frame, first_other_->particle, first_other_->by);
  }

  const RunMap map_;
  const RunHeader a_, b_;
  const int noise_runs_;
  const bool bits_;
  double u_ = 0;
  std::vector<Found> found_;
  std::vector<std::string> notes_;
  std::vector<int32_t> permutation_, inverse_;
  std::vector<Vec3> first_;
  std::vector<uint8_t> both_;
  int64_t frame_ = 0, frames_ = 0, lost_ = -1;
  double extent_ = 0, moved_ = 0, substep_ = 0;
  std::optional<double> time_at_first_;
  std::optional<Other> first_other_;
  bool is_coupled_otherwise_ = false;
  bool may_branch_ = false;  // a disturbed run has: from then on decisions are not compared
  RelationSharpness sharpest_;
};

RunRelation::RunRelation(const RunMap& map, RunHeader a, RunHeader b, int noise_runs, bool bits)
    : self_(std::make_unique<Implementation>(map, std::move(a), std::move(b), noise_runs, bits)) {}
RunRelation::~RunRelation() = default;
void RunRelation::permute(std::vector<int32_t> permutation) { self_->permute(std::move(permutation)); }
void RunRelation::weigh(std::vector<double> a, std::vector<double> b) { self_->weigh(std::move(a), std::move(b)); }
void RunRelation::see(const RelatedRun& a, const RelatedRun& b, std::span<const RelatedRun> noise) {
  self_->see(a, b, noise);
}
void RunRelation::see_end_of_some(int64_t frame) { self_->see_end_of_some(frame); }
void RunRelation::finish() { self_->finish(); }
std::vector<Verdict> RunRelation::verdicts() const { return self_->verdicts(); }
std::vector<RunJudge::NotAsked> RunRelation::not_asked() const { return self_->not_asked(); }
std::vector<std::string> RunRelation::notes() const { return self_->notes(); }
RelationSharpness RunRelation::sharpest() const { return self_->sharpest(); }

RunRefinement::RunRefinement(std::vector<RunHeader> headers)
    : headers_(std::move(headers)), farthest_(headers_.size() - 1, 0.0) {}

void RunRefinement::fail(std::string text) {
  if (wrong_.empty()) wrong_ = std::move(text);
}

void RunRefinement::see_end_of_some(int64_t frame) {
  fail(fmt::format("a run ends after {} frames, and another one goes on", frame));
}

void RunRefinement::see(std::span<const RelatedRun> runs) {
  ++frames_;
  const double n = static_cast<double>(frames_ * headers_.back().steps);
  for (const RelatedRun& run : runs) {
    const std::optional<double> time = run.frame.time, wanted = runs.front().frame.time;
    if (time && wanted && !(std::abs(*time - *wanted) <= 4 * headers_.back().u * n * std::abs(*wanted)))
      fail(fmt::format("frame {} is at {} s in one run and at {} s in another", frames_ - 1, *wanted, *time));
  }
  for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
    const std::span<const Vec3> coarse = runs[k].frame.positions, fine = runs[k + 1].frame.positions;
    if (coarse.size() != fine.size())
      return fail(fmt::format("frame {} has {} particles in one run and {} in another", frames_ - 1, coarse.size(),
                              fine.size()));
    for (std::size_t i = 0; i < coarse.size(); ++i) {
      const bool in_coarse = exists(runs[k].frame, i), in_fine = exists(runs[k + 1].frame, i);
      if (!in_coarse && !in_fine) continue;
      if (in_coarse) extent_ = std::max(extent_, norm(coarse[i]));
      farthest_[k] = std::max(
          farthest_[k], in_coarse && in_fine ? distance(coarse[i], fine[i]) : std::numeric_limits<double>::infinity());
    }
  }
}

std::vector<Verdict> RunRefinement::verdicts() const {
  Verdict form = fresh(kFrames), converges, judged = fresh(kJudged);
  form.checked = frames_;
  form.holds = wrong_.empty();
  form.witness.text = wrong_;
  if (!form.holds) return {form};
  converges.property = "converges";
  converges.unit = "m";
  converges.bound_source = kSource;
  double worst = -1;
  for (std::size_t k = 0; k + 1 < farthest_.size(); ++k) {
    const double ratio = static_cast<double>(headers_[k + 1].steps) / static_cast<double>(headers_[k].steps);
    const double n = static_cast<double>(frames_ * headers_.back().steps);
    // Of first order the difference shrinks as the substep does; rounding is all that may be left.
    const double bound = std::max(farthest_[k] / std::sqrt(ratio), headers_.back().u * extent_ * carried_roundings(n));
    ++converges.checked;
    const double share = farthest_[k + 1] == 0 ? 0 : farthest_[k + 1] / bound;
    if (share <= worst) continue;
    worst = share;
    converges.measured = farthest_[k + 1];
    converges.bound = bound;
    if (farthest_[k + 1] <= bound && std::isfinite(bound)) continue;
    converges.holds = false;
    if (!std::isfinite(farthest_[k + 1])) {
      converges.witness.text = fmt::format("a particle exists with {} or with {} substeps alone", headers_[k + 1].steps,
                                           headers_[k + 2].steps);
      continue;
    }
    converges.witness.text = fmt::format(
        "with {} substeps instead of {} the run moves by {:.3g} m, and it moved by {:.3g} m from {} to {}: "
        "no order of convergence",
        headers_[k + 2].steps, headers_[k + 1].steps, farthest_[k + 1], farthest_[k], headers_[k].steps,
        headers_[k + 1].steps);
  }
  judged.checked = 1;
  judged.holds = farthest_.front() > 0;
  if (!judged.holds) judged.witness.text = "more substeps change nothing: nothing was tested";
  return {form, converges, judged};
}

}  // namespace cutproof::oracles
