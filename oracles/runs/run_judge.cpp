#include "oracles/runs/run_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "model/at.h"
#include "model/counted.h"
#include "oracles/rounding.h"
#include "oracles/runs/cells.h"
#include "oracles/runs/pieces.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

constexpr const char* kSource = "tolerances.md, Runs";
enum Which : std::size_t {
  kForm,
  kFinite,
  kGone,
  kTeleport,
  kSomethingCut,
  kAcross,
  kWithin,
  kSaid,
  kMomentum,
  kCentre,
  kAngular,
  kEnergy,
  kInverted,
  kTissue,
  kMass,
  kProperties
};

// How much faster than any velocity at the ends of frames those in between may be, about their mean.
constexpr double kBetween = 2.5;

// One whose square is none is beyond all bounds.
bool is_number(Vec3 x) { return std::isfinite(dot(x, x)); }

// The change of a vector from length `was` to length `is`; `off`: the length of the difference.
std::string change_in_words(double was, double is, double off) {
  if (!(was > 0)) return "angular momentum appears";
  const double lost = was - is;
  if (lost > 0.5 * off) return fmt::format("{:.3g} % of the angular momentum is lost", 100 * lost / was);
  return fmt::format("angular momentum changes by {:.3g} %", 100 * off / was);
}

// A sum of many. In double precision each addition of equal numbers may round the same way, by more in all than bounds
// allow.
struct WideSum {
  long double x = 0, y = 0, z = 0;
  void operator+=(Vec3 a) { x += a.x, y += a.y, z += a.z; }
  operator Vec3() const { return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}; }
};

// A property of runs, by Which. `needs`: what a run has to have so that it is asked.
struct RunProperty {
  const char *name, *unit, *source, *needs;
};
constexpr RunProperty kRunProperties[kProperties] = {
    {"run well formed", "1", "docs/reference/run.md", "nothing"},
    {"finite", "1", kSource, "nothing"},
    {"what is gone stays gone", "1", kSource, "nothing"},
    {"no teleport", "m", kSource, "velocities and time"},
    {"something was cut", "1", kSource, "a blade, and tissue: edges, cells, nodes, or rest and spacing"},
    {"no coupling across pieces", "1", kSource, "coupling groups or cells, and tissue"},
    {"pieces coupled within", "1", kSource, "coupling groups or cells, tissue and a blade"},
    {"pieces as said", "1", kSource, "piece and tissue"},
    {"linear momentum", "kg m/s", kSource, "velocities, mass, time, and contact_impulse or the promise 'free'"},
    {"centre of mass", "m", kSource, "velocities, mass, time, and contact_impulse or the promise 'free'"},
    {"angular momentum", "kg m²/s", kSource, "the promise 'angular_momentum', velocities, mass and time"},
    {"energy", "J", kSource, "the promise 'energy', and energy"},
    {"no inverted cell", "1", kSource, "cells"},
    {"tissue kept", "1", kSource, "cells and rest"},
    {"mass kept", "kg", kSource, "mass that is given anew"},
};

// The most particles that share a coordinate.
int64_t largest_plane(std::span<const Vec3> places) {
  std::ptrdiff_t most = 1;
  std::vector<double> values(places.size());
  for (double Vec3::*const axis : {&Vec3::x, &Vec3::y, &Vec3::z}) {
    for (std::size_t i = 0; i < places.size(); ++i) values[i] = places[i].*axis;
    std::erase_if(values, [](double value) { return std::isnan(value); });
    std::sort(values.begin(), values.end());
    for (auto begin = values.begin(); begin != values.end();) {
      const auto end = std::upper_bound(begin, values.end(), *begin);
      most = std::max(most, end - begin);
      begin = end;
    }
    values.resize(places.size());
  }
  return most;
}

}  // namespace

class RunJudge::Implementation {
 public:
  explicit Implementation(RunHeader header) : header_(std::move(header)), found_(kProperties) {
    for (std::size_t k = 0; k < kProperties; ++k) found_[k].verdict = fresh(static_cast<Which>(k));
    found_[kForm].verdict.checked = 1;
  }

  void couple(RunCoupling coupling) {
    coupling_ = std::move(coupling);
    const std::vector<int64_t>& offsets = coupling_.offsets;
    if (!offsets.empty() && (offsets.front() != 0 || offsets.back() != std::ssize(coupling_.members) ||
                             !std::is_sorted(offsets.begin(), offsets.end()))) {
      fail(kForm, {}, "groups_offsets do not begin at 0, ascend and end at {} members", coupling_.members.size());
    }
    if (const auto bad = std::find_if_not(coupling_.weights.begin(), coupling_.weights.end(),
                                          [](double weight) { return std::isfinite(weight); });
        bad != coupling_.weights.end()) {
      fail(kForm, {}, "weight {} of groups_weights is {}", bad - coupling_.weights.begin(), *bad);
    }
    is_coupled_ = !offsets.empty() || coupling_.corners > 0;  // no groups are an answer, too: nothing is coupled
    largest_group_ = coupling_.corners;
    for (std::size_t g = 0; g + 1 < offsets.size(); ++g) {
      largest_group_ = std::max(largest_group_, offsets[g + 1] - offsets[g]);
    }
    is_new_coupling_ = true;
  }

  void weigh(std::vector<double> mass) {
    mass_ = std::move(mass);
    is_new_mass_ = true;
  }

  void see(const RunFrame& frame) {
    if (!holds(kForm) || !holds(kFinite)) return;  // nothing else means anything
    frame_ = frame.index;
    ++frames_;
    n_ = std::ssize(frame.positions);
    if (n_ < std::ssize(was_)) {
      return fail(kForm, {}, "frame {} has {} particles, and the one before has {}", frame_, n_, was_.size());
    }
    if (frame.time && (!std::isfinite(*frame.time) || (time_was_ && !(*frame.time > *time_was_)))) {
      return fail(kForm, {}, "time does not ascend: {} s after {} s", *frame.time, time_was_.value_or(0));
    }
    if (!check_blade(frame) || !check_parents(frame)) return;
    if (is_new_coupling_ && !check_members()) return;
    find_existing(frame);
    check_finite(frame);
    if (!holds(kFinite) || !holds(kForm)) return;
    if (frames_ == 1) {
      largest_plane_ = largest_plane(frame.positions);
      lay_tissue();
      if (tissue_) pieces_at_first_ = tissue_->apart().count;
    }
    if (!was_.empty()) {
      teleport(frame);
      momenta(frame);
    }
    for (std::size_t i = parent_.size(); i < frame.parent.size(); ++i) parent_.push_back(frame.parent[i]);
    parent_.resize(at(n_), -1);
    masses();
    energy(frame);
    cells(frame);
    cut(frame);
    if (is_coupled_ && tissue_) {
      if (is_new_coupling_ || !frame.blade.empty() || is_new_gone_) {
        partitions();
      } else {
        for (const Which which : {kAcross, kWithin}) count_frame(found_[which], found_[which].last_holds);
      }
    }
    if (!frame.piece.empty()) said(frame);
    is_new_coupling_ = is_new_gone_ = is_new_mass_ = false;
    was_.assign(frame.positions.begin(), frame.positions.end());
    velocity_was_.assign(frame.velocities.begin(), frame.velocities.end());
    spin_was_.assign(frame.spin.begin(), frame.spin.end());
    existed_ = exists_;
    time_was_ = frame.time;
  }

  void finish() {
    if (frames_ == 0) fail(kForm, {}, "the run has no frames");
    // Where no blade was ever shown, nobody knows what it may have parted.
    if (!has_blade_) found_[kWithin].verdict = fresh(kWithin);
    if (has_blade_ && tissue_ && holds(kForm) && holds(kFinite)) {
      Verdict& verdict = found_[kSomethingCut].verdict;
      verdict.checked = 1;
      // What the blade takes away parts tissue, too.
      const bool is_cut = tissue_->surely_cut() > 0 || tissue_->apart().count > pieces_at_first_;
      verdict.measured = is_cut ? 0 : 1;
      if (!is_cut)
        fail(kSomethingCut, {}, "the blade cuts no edge of the tissue, and touches {}: nothing was tested",
             tissue_->perhaps_cut());
    }
    for (std::size_t k = 0; k < kProperties; ++k) tell_frames(static_cast<Which>(k));
    if (!found_[kAngular].verdict.checked && lost_ > 0) {
      notes_.push_back(
          fmt::format("The run loses up to {:.2g} of its angular momentum in a frame (frame {}). A scheme "
                      "may do so; promise 'angular_momentum' if yours must not.",
                      lost_, lost_at_));
    }
  }

  std::vector<Verdict> verdicts() const {
    std::vector<Verdict> all;
    for (const Found& found : found_) {
      if (found.verdict.checked > 0 || !found.verdict.holds) all.push_back(found.verdict);
    }
    return all;
  }
  std::vector<NotAsked> not_asked() const {
    std::vector<NotAsked> all;
    for (std::size_t k = 0; k < kProperties; ++k) {
      const Verdict& verdict = found_[k].verdict;
      if (verdict.checked > 0 || !verdict.holds) continue;
      const bool is_stopped = !holds(kForm) || !holds(kFinite);
      all.push_back({verdict.property, is_stopped               ? "the run is not well formed, or not finite"
                                       : !found_[k].why.empty() ? found_[k].why
                                                                : "needs " + std::string(kRunProperties[k].needs)});
    }
    return all;
  }
  const std::vector<std::string>& notes() const { return notes_; }
  RunPieces pieces() const {
    RunPieces made;
    if (!tissue_) return made;
    const SweptTissue::Pieces apart = tissue_->apart(), together = tissue_->together();
    made.of_cells = by_cells();
    made.units = std::ssize(apart.label);
    made.at_first = pieces_at_first_;
    made.pieces = apart.count;
    made.at_most = together.count;
    made.sizes.resize(at(apart.count));
    for (const int32_t label : apart.label) {
      if (label >= 0) ++made.sizes[at(label)];
    }
    std::sort(made.sizes.rbegin(), made.sizes.rend());
    made.surely_cut = tissue_->surely_cut();
    made.perhaps_cut = tissue_->perhaps_cut();
    made.ever_perhaps_cut = tissue_->ever_perhaps_cut();
    for (int32_t k = 0; k < made.units; ++k) made.beside += tissue_->is_beside(k);
    made.coupled = coupled_count_;
    made.last_cut = last_cut_;
    return made;
  }
  std::vector<int32_t> piece_of_particles(bool touched_is_cut) const {
    if (!tissue_ || !holds(kForm) || !holds(kFinite)) return {};
    const SweptTissue::Pieces apart = touched_is_cut ? tissue_->together() : tissue_->apart();
    std::vector<int32_t> piece(at(n_), -1), lowest(at(apart.count), std::numeric_limits<int32_t>::max());
    const auto each_particle = [&](const auto& visit) {
      for (int32_t unit = 0; unit < units_; ++unit) {
        if (apart.label[at(unit)] < 0) continue;
        const auto of = at(apart.label[at(unit)]);
        if (!by_cells()) visit(unit, lowest[of]);
        for (int k = 0; k < unit_corners_; ++k)
          visit(coupling_.cells[at(unit) * at(unit_corners_) + at(k)], lowest[of]);
      }
    };
    each_particle([](int32_t particle, int32_t& of) { of = std::min(of, particle); });
    each_particle([&](int32_t particle, int32_t of) { piece[at(particle)] = of; });
    return piece;
  }

 private:
  struct Found {
    Verdict verdict;
    double nearest = -1;                         // measured / bound
    std::string why;                             // it was not asked
    int64_t frames = 0, failing = 0, last = -1;  // frames in which it was judged, and fails; the last of them
    std::vector<int64_t> ranges;                 // of frames in which it fails: the first and the last of each
    double worst = 0;                            // of what is beyond its bound, and in which frame
    int64_t worst_frame = -1;
    bool last_holds = true;
  };

  static Verdict fresh(Which which) {
    const RunProperty& property = kRunProperties[which];
    Verdict verdict;
    verdict.property = property.name;
    verdict.unit = property.unit;
    verdict.bound_source = property.source;
    return verdict;
  }
  bool holds(Which which) const { return found_[which].verdict.holds; }
  template <class... Args>
  void fail(Which which, Concerned concerned, fmt::format_string<Readable<Args>...> text, Args&&... args) {
    Verdict& verdict = found_[which].verdict;
    if (!verdict.holds) return;
    verdict.holds = false;
    verdict.frame = frame_;
    verdict.witness = witness_of<Args...>(std::move(concerned), text, std::forward<Args>(args)...);
  }
  void count_frame(Found& found, bool holds) {
    const bool is_new = found.last != frame_, had_failed = !is_new && !found.last_holds;
    found.frames += is_new;
    if (!holds && !had_failed) {
      ++found.failing;
      std::vector<int64_t>& frames = found.ranges;
      if (!frames.empty() && frames.back() + 1 == frame_) {
        frames.back() = frame_;
      } else {
        frames.insert(frames.end(), 2, frame_);
      }
    }
    found.last_holds = holds && !had_failed;
    found.last = frame_;
  }
  // Of a failure: in how many frames.
  void tell_frames(Which which) {
    Found& found = found_[which];
    if (found.verdict.holds || found.frames == 0) return;
    found.verdict.witness.frames = found.ranges;
    std::string& text = found.verdict.witness.text;
    if (which == kFinite) {
      text += ". Later frames are not judged";
    } else if (found.failing == 1) {
      text += fmt::format(". The property fails in this frame alone, of {} judged", found.frames);
    } else {
      text += fmt::format(". The property fails in {} of {} judged frames, first in frame {} and last in frame {}",
                          found.failing, found.frames, found.ranges.front(), found.ranges.back());
      if (found.worst_frame > found.verdict.frame && std::isfinite(found.worst)) {
        const bool is_count = found.verdict.unit == "1";
        text += fmt::format(", worst in frame {}: {:.3g}{}{}", found.worst_frame, found.worst, is_count ? "" : " ",
                            is_count ? "" : found.verdict.unit);
      }
    }
  }
  // Whether a comparison is within its bound; the first that is not is kept, or else that which comes nearest.
  bool within(Which which, double measured, double bound) {
    Found& found = found_[which];
    ++found.verdict.checked;
    const bool is_within = measured <= bound && std::isfinite(bound);
    count_frame(found, is_within);
    if (!is_within && (found.worst_frame < 0 || measured > found.worst)) {
      found.worst = measured;
      found.worst_frame = frame_;
    }
    const bool is_first_failure = !found.verdict.holds && found.verdict.frame == frame_ && std::isfinite(found.nearest);
    if (!found.verdict.holds && !is_first_failure) return true;
    const double ratio = is_within ? (bound > 0 ? measured / bound : 0) : std::numeric_limits<double>::infinity();
    if (ratio > found.nearest) {
      found.nearest = ratio;
      found.verdict.measured = measured;
      found.verdict.bound = bound;
      found.verdict.frame = frame_;
    }
    return is_within;
  }

  bool check_members() {
    const auto wrong = [&](const std::vector<int32_t>& members) {
      return std::find_if(members.begin(), members.end(), [&](int32_t i) { return i < 0 || i >= n_; });
    };
    if (const auto bad = wrong(coupling_.members); bad != coupling_.members.end()) {
      fail(kForm, {}, "a group has particle {} of {}", *bad, n_);
      return false;
    }
    if (const auto bad = wrong(coupling_.cells); bad != coupling_.cells.end()) {
      fail(kForm, {}, "a cell has particle {} of {}", *bad, n_);
      return false;
    }
    return true;
  }

  // Each patch is there, or, with no corner at all, is none.
  bool check_blade(const RunFrame& frame) {
    for (std::size_t k = 0; k + 4 <= frame.blade.size(); k += 4) {
      const auto corners = frame.blade.subspan(k, 4);
      if (std::ranges::all_of(corners, is_number) || std::ranges::all_of(corners, is_blank)) continue;
      fail(kForm, {}, "patch {} of the blade has corners that are no numbers in frame {}", k / 4, frame_);
      return false;
    }
    return true;
  }
  bool check_parents(const RunFrame& frame) {
    for (std::size_t i = parent_.size(); i < frame.parent.size(); ++i) {
      if (frame.parent[i] >= -1 && frame.parent[i] < n_) continue;
      fail(kForm, {}, "particle {} was split from {} of {}", i, frame.parent[i], n_);
      return false;
    }
    return true;
  }

  void find_existing(const RunFrame& frame) {
    exists_.resize(at(n_));
    for (std::size_t i = 0; i < exists_.size(); ++i) exists_[i] = exists(frame, i);
    ever_.resize(exists_.size());
    int64_t revived = 0;
    int32_t first = -1;
    for (std::size_t i = 0; i < exists_.size(); ++i) {
      const bool existed = i < existed_.size() && existed_[i] != 0;
      if (exists_[i] != 0 && !existed && ever_[i] != 0) {
        if (++revived == 1) first = static_cast<int32_t>(i);
      }
      if (exists_[i] == 0 && existed) is_new_gone_ = true;
      ever_[i] |= exists_[i];
    }
    if (frames_ > 1 && !within(kGone, static_cast<double>(revived), 0))
      fail(kGone, {{}, {first}}, "{} that {} gone {} there again in frame {}, for example {}",
           counted(revived, "particle", "particles"), revived == 1 ? "was" : "were", revived == 1 ? "is" : "are",
           frame_, first);
  }

  void check_finite(const RunFrame& frame) {
    int64_t wrong = 0;
    for (std::size_t i = 0; i < exists_.size(); ++i) {
      if (exists_[i] == 0) continue;
      const char* const wrong_one = !is_number(frame.positions[i])                                 ? "position"
                                    : !frame.velocities.empty() && !is_number(frame.velocities[i]) ? "velocity"
                                    : !frame.spin.empty() && !is_number(frame.spin[i])             ? "spin"
                                                                                                   : nullptr;
      if (wrong_one == nullptr) continue;
      ++wrong;
      fail(kFinite, {{}, {static_cast<int32_t>(i)}}, "the {} of particle {} is not a number in frame {}", wrong_one, i,
           frame_);
    }
    for (const auto& [is_fine, name] : {std::pair{is_number(frame.contact_impulse.value_or(Vec3{})), "contact_impulse"},
                                        std::pair{std::isfinite(frame.energy.value_or(0)), "energy"}}) {
      if (is_fine) continue;
      ++wrong;
      fail(kFinite, {}, "{} is not a number in frame {}", name, frame_);
    }
    within(kFinite, static_cast<double>(wrong), 0);
  }

  // Units of tissue are cells where there are cells.
  bool by_cells() const { return unit_corners_ > 0; }
  int32_t unit_particle(int32_t unit) const {
    return by_cells() ? coupling_.cells[at(unit) * at(unit_corners_)] : unit;
  }
  Vec3 place_of(std::span<const Vec3> x, int32_t unit) const {
    if (!by_cells()) return x[at(unit)];
    Vec3 sum;
    for (int k = 0; k < unit_corners_; ++k) sum += x[at(coupling_.cells[at(unit) * at(unit_corners_) + at(k)])];
    return sum / static_cast<double>(unit_corners_);
  }

  void lay_tissue() {
    for (std::size_t i = 0; i < header_.rest.size(); ++i) {
      if (is_number(header_.rest[i]) || is_blank(header_.rest[i])) continue;
      return fail(kForm, {{}, {static_cast<int32_t>(i)}}, "the place of rest of particle {} is not a number", i);
    }
    if (coupling_.corners > 0) {
      unit_corners_ = coupling_.corners;
      units_ = static_cast<int32_t>(std::ssize(coupling_.cells) / unit_corners_);
      tissue_.emplace(units_, tissue_of_cells(coupling_.cells, unit_corners_));
      return;
    }
    units_ = static_cast<int32_t>(n_);
    if (!header_.edges.empty()) {
      for (const auto& [a, b] : header_.edges) {
        if (a < 0 || b < 0 || a >= n_ || b >= n_) return fail(kForm, {}, "an edge joins {} and {} of {}", a, b, n_);
      }
      tissue_.emplace(units_, header_.edges);
      return;
    }
    if (std::ssize(header_.rest) != n_ || !(header_.spacing > 0)) return;
    if (auto joined = tissue_at_rest(header_.rest, header_.spacing)) {
      tissue_.emplace(units_, *std::move(joined));
    } else {
      fail(kForm, {}, "particles do not rest about spacing = {} m apart: more than {} within that, or beyond {:.2g} m",
           header_.spacing, kMostWithinSpacing, kFarthestInSpacings * header_.spacing);
    }
  }

  // Each particle goes where its velocity takes it: nothing may jump.
  void teleport(const RunFrame& frame) {
    if (frame.velocities.empty() || velocity_was_.empty() || !frame.time || !time_was_) return;
    // Contacts push to all sides, and of what they do in a frame only the sum is known.
    if (frame.contact_impulse && norm(*frame.contact_impulse) > 0) {
      found_[kTeleport].why = "contacts push in every frame";
      return;
    }
    const double dt = *frame.time - *time_was_;
    double count = 0, farthest = 0, fastest = 0;
    Vec3 mean, mean_was;
    for (std::size_t i = 0; i < was_.size(); ++i) {
      if (exists_[i] == 0 || existed_[i] == 0) continue;
      ++count;
      mean += frame.velocities[i];
      mean_was += velocity_was_[i];
      fastest = std::max({fastest, norm(frame.velocities[i]), norm(velocity_was_[i])});
      farthest = std::max({farthest, norm(was_[i]), norm(frame.positions[i])});
    }
    if (count == 0) return;
    mean = mean / count;
    mean_was = mean_was / count;
    for (std::size_t i = 0; i < was_.size(); ++i) {
      if (exists_[i] == 0 || existed_[i] == 0) continue;
      fastest_ = std::max({fastest_, norm(frame.velocities[i] - mean), norm(velocity_was_[i] - mean_was)});
    }
    const Vec3 gravity = header_.gravity.value_or(Vec3{});
    const double between = fastest_ + norm(mean - mean_was - dt * gravity);
    const double bound = kBetween * dt * (between + fastest * lag(dt)) + 0.5 * dt * dt * norm(gravity) +
                         4 * header_.u * (static_cast<double>(header_.steps) * farthest + *frame.time * fastest) +
                         (header_.promised(RunPromise::free) ? 0 : sweep_reach(frame)) + header_.cut_resolution;
    for (std::size_t i = 0; i < was_.size(); ++i) {
      if (exists_[i] == 0 || existed_[i] == 0 || (!frame.held.empty() && frame.held[i] != 0)) continue;
      const Vec3 way = (0.5 * dt) * (frame.velocities[i] + velocity_was_[i]);
      const double off = norm(frame.positions[i] - was_[i] - way);
      if (!within(kTeleport, off, bound))
        fail(kTeleport, {{}, {static_cast<int32_t>(i)}},
             "particle {} is {:.3g} m from where its velocity takes it in frame {}; no velocity is farther than {:.3g} "
             "m/s from their mean",
             i, off, frame_, between);
    }
  }
  // The greatest share by which a velocity at the end of a frame is less than the velocity of the way. A scheme moves
  // particles first, and then damps velocities by exp(-c dt / S), or by 1 - c dt / S while that is positive.
  double lag(double dt) const {
    const double decay = header_.damping * dt / static_cast<double>(header_.steps);
    return std::max(std::expm1(decay), decay < 1 ? decay / (1 - decay) : 0);
  }
  // How far a blade may have pushed something out of its way: as far as it sweeps in this frame.
  static double sweep_reach(const RunFrame& frame) {
    double reach = 0;
    for (std::size_t k = 0; k + 4 <= frame.blade.size(); k += 4) {
      for (std::size_t side = 0; side < 4; ++side) {
        const double length = norm(frame.blade[k + side] - frame.blade[k + (side + 1) % 4]);
        if (std::isfinite(length)) reach = std::max(reach, length);
      }
    }
    return reach;
  }

  // Sums over all that exists: momentum, its centre, its angular momentum about that.
  void momenta(const RunFrame& frame) {
    if (frame.velocities.empty() || velocity_was_.empty() || !frame.time || !time_was_) return;
    if (std::min(std::ssize(mass_), std::ssize(mass_was_)) < n_ || exists_ != existed_) {
      found_[kMomentum].why = found_[kCentre].why = "mass is not given of all, or particles come and go in every frame";
      return;
    }
    if (std::find(exists_.begin(), exists_.end(), 1) == exists_.end()) return;
    const bool is_held = std::any_of(frame.held.begin(), frame.held.end(), [](uint8_t held) { return held != 0; });
    const bool is_free = header_.promised(RunPromise::free);
    if (!is_free && !frame.contact_impulse) return;
    if (is_held && !frame.contact_impulse) return;
    const double dt = *frame.time - *time_was_, dt_s = dt / static_cast<double>(header_.steps);
    const Vec3 gravity = header_.gravity.value_or(Vec3{}), impulse = frame.contact_impulse.value_or(Vec3{});
    long double mass_sum = 0, mass_was_sum = 0;
    double squares = 0, farthest = 0;
    WideSum p_sum, p_was_sum, x_sum, x_was_sum;
    for (std::size_t i = 0; i < exists_.size(); ++i) {
      if (exists_[i] != 0) farthest = std::max({farthest, norm(frame.positions[i]), norm(was_[i])});
    }
    for (std::size_t i = 0; i < exists_.size(); ++i) {
      if (exists_[i] == 0) continue;
      // A cut may move mass from one particle to another; the frame before had the masses of then.
      const double m = mass_[i], m_was = mass_was_[i];
      mass_sum += m;
      mass_was_sum += m_was;
      p_sum += m * frame.velocities[i];
      p_was_sum += m_was * velocity_was_[i];
      x_sum += m * frame.positions[i];
      x_was_sum += m_was * was_[i];
      const double rounds =
          std::max(m, m_was) * (norm(frame.velocities[i]) + norm(velocity_was_[i]) + kStableForces * farthest / dt_s);
      squares += rounds * rounds;
    }
    const Vec3 p = p_sum, p_was = p_was_sum;
    const auto mass = static_cast<double>(mass_sum), mass_was = static_cast<double>(mass_was_sum);
    const Vec3 x = Vec3(x_sum) / mass, x_was = Vec3(x_was_sum) / mass_was, v = p / mass, v_was = p_was / mass_was;
    const double steps = static_cast<double>(header_.steps), decay = header_.damping * dt;
    // One rounding of a group, as of a cluster's translation, moves all its particles alike. Equal coordinates round
    // alike, as those of a grid that moves without turning.
    const auto alike = static_cast<double>(std::max(largest_group_, largest_plane_));
    const double rounding = kDeviations * header_.u * std::sqrt(steps * alike * squares);
    // A scheme damps by (1 - c dt / S)^S, its inverse, or between: (c dt)² off the exponential at most, and what is
    // added meanwhile is damped or not.
    const double pushed = norm(impulse) + mass * norm(gravity) * dt + norm(p_was);
    // The impulse is a sum over particles and substeps.
    const double adding = kDeviations * header_.u * std::sqrt(steps * static_cast<double>(n_)) * norm(impulse);
    const Vec3 expected =
        std::exp(-decay) * p_was + (decay > 0 ? -std::expm1(-decay) / decay : 1) * (mass * dt * gravity) + impulse;
    const double slack =
        decay * decay * norm(p_was) + (decay + decay * decay) * (norm(impulse) + mass * norm(gravity) * dt);
    const double off = norm(p - expected);
    if (!within(kMomentum, off, rounding + slack + adding + 4 * header_.u * pushed))
      fail(kMomentum, {},
           "momentum changes by {:.3g} kg m/s in frame {} more than gravity and contacts explain: the whole body gains "
           "{:.3g} m/s",
           off, frame_, off / mass);
    if (norm(impulse) == 0 && !is_held && (is_free || frame.blade.empty())) {
      // The mean velocity of the frame lies between those of its ends; half a substep of gravity either way.
      const Vec3 middle = 0.5 * (v + v_was);
      const double way = norm((x - x_was) - dt * middle);
      const double between = dt * (0.5 * norm(v - v_was) + lag(dt) * std::max(norm(v), norm(v_was)));
      const double places = header_.u * (kDeviations * std::sqrt(steps) * farthest + 4 * *frame.time * norm(middle));
      if (!within(kCentre, way, between + places + dt * rounding / mass))
        fail(kCentre, {}, "the centre of mass is {:.3g} m from where its velocity takes it in frame {}", way, frame_);
      angular(frame, x, x_was, v, v_was, rounding, farthest);
    }
  }

  void angular(const RunFrame& frame, Vec3 x, Vec3 x_was, Vec3 v, Vec3 v_was, double rounding, double farthest) {
    WideSum spins_sum, spins_was_sum;
    double size = 0;
    for (std::size_t i = 0; i < exists_.size(); ++i) {
      if (exists_[i] == 0) continue;
      const double m = mass_[i];
      const Vec3 arm = frame.positions[i] - x, was = was_[i] - x_was;
      spins_sum += m * cross(arm, frame.velocities[i] - v);
      spins_was_sum += mass_was_[i] * cross(was, velocity_was_[i] - v_was);
      if (!frame.spin.empty()) spins_sum += frame.spin[i];
      if (!spin_was_.empty()) spins_was_sum += spin_was_[i];
      size += m * norm(arm) * norm(frame.velocities[i] - v);
    }
    const Vec3 spins = spins_sum, spins_was = spins_was_sum;
    const double off = norm(spins - spins_was);
    if (header_.promised(RunPromise::angular_momentum)) {
      const double decay = header_.damping * *frame.time - header_.damping * *time_was_;
      if (!within(kAngular, off,
                  2 * farthest * rounding + kDeviations * header_.u * size + 2 * decay * norm(spins_was)))
        fail(kAngular, {},
             "{} in frame {}, although no outside force acts: from {:.4g} to {:.4g} kg m²/s; the vector changes by "
             "{:.4g} kg m²/s",
             change_in_words(norm(spins_was), norm(spins), off), frame_, norm(spins_was), norm(spins), off);
    } else if (norm(spins_was) > 1e3 * (2 * farthest * rounding) && off / norm(spins_was) > lost_) {
      lost_ = off / norm(spins_was);
      lost_at_ = frame_;
    }
  }

  // Vertices that are split share the mass of the one that they come from.
  void masses() {
    if (!is_new_mass_ || std::ssize(mass_) != n_) return;
    if (!mass_was_.empty()) {
      const auto sum = [](const std::vector<double>& masses) {
        return static_cast<double>(std::accumulate(masses.begin(), masses.end(), 0.0L));
      };
      const double mass = sum(mass_), was = sum(mass_was_);
      if (!within(kMass, std::abs(mass - was), kDeviations * header_.u * std::sqrt(static_cast<double>(n_)) * was))
        fail(kMass, {}, "there are {:.6g} kg in frame {}, and there were {:.6g}", mass, frame_, was);
    }
    mass_was_ = mass_;
  }

  void energy(const RunFrame& frame) {
    if (!header_.promised(RunPromise::energy) || !frame.energy) return;
    const bool is_pushed = (frame.contact_impulse && norm(*frame.contact_impulse) > 0) || !frame.blade.empty() ||
                           std::any_of(frame.held.begin(), frame.held.end(), [](uint8_t held) { return held != 0; });
    if (energy_was_ && !is_pushed) {
      const double grown = *frame.energy - *energy_was_;
      const double bound = kDeviations * header_.u * std::sqrt(static_cast<double>(header_.steps * n_)) *
                           (std::abs(*energy_was_) + std::abs(*frame.energy));
      if (!within(kEnergy, std::max(0.0, grown), bound))
        fail(kEnergy, {},
             "energy grows by {:.3g} J in frame {}, although no outside force acts: from {:.6g} to {:.6g} J", grown,
             frame_, *energy_was_, *frame.energy);
    }
    energy_was_ = frame.energy;
  }

  void cells(const RunFrame& frame) {
    const int corners = coupling_.corners;
    if (corners == 0) return;
    const std::size_t count = coupling_.cells.size() / at(corners);
    std::size_t first = 0;
    int64_t inverted = 0;
    double volume = 0;
    Vec3 x[8], rest[8];
    const bool weighs = is_new_coupling_ && !header_.rest.empty();
    for (std::size_t cell = 0; cell < count; ++cell) {
      bool exists = true, has_rest = weighs;
      for (std::size_t k = 0; k < at(corners); ++k) {
        const int32_t i = coupling_.cells[cell * at(corners) + k];
        x[k] = frame.positions[at(i)];
        exists &= exists_[at(i)] != 0;
        const int32_t of = rest_of(i);
        has_rest &= of >= 0 && is_number(header_.rest[at(of)]);
        if (has_rest) rest[k] = header_.rest[at(of)];
      }
      if (!exists) continue;
      if (has_rest) volume += size_of(rest, corners);
      if (!is_inverted(x, corners)) continue;
      if (++inverted == 1) first = cell;
    }
    if (!within(kInverted, static_cast<double>(inverted), 0)) {
      const auto begin = coupling_.cells.begin() + static_cast<std::ptrdiff_t>(first * at(corners));
      fail(kInverted, {{}, {begin, begin + corners}},
           "{} of {} cells {} inverted in frame {}, for example cell {} at particle {}", inverted, count,
           inverted == 1 ? "is" : "are", frame_, first, *begin);
    }
    if (!weighs) return;
    if (!volume_at_rest_) volume_at_rest_ = volume;
    if (*volume_at_rest_ == 0) return;
    const double lost = std::abs(volume - *volume_at_rest_) / std::abs(*volume_at_rest_);
    if (!within(kTissue, lost, kDeviations * header_.u * static_cast<double>(count)))
      fail(kTissue, {}, "cells have {:.6g} m³ at rest in frame {}, and had {:.6g}", volume, frame_, *volume_at_rest_);
  }
  // Whose place at rest a vertex has: its own, or that of the one that it was split from; -1: nobody knows.
  int32_t rest_of(int32_t i) const {
    const int64_t known = std::ssize(header_.rest);
    while (i >= known && at(i) < parent_.size() && parent_[at(i)] >= 0 && parent_[at(i)] < i) i = parent_[at(i)];
    return i < known ? i : -1;
  }

  void cut(const RunFrame& frame) {
    has_blade_ |= !frame.blade.empty();
    if (!tissue_ || (by_cells() && (coupling_.corners != unit_corners_ ||
                                    std::ssize(coupling_.cells) != int64_t{units_} * unit_corners_))) {
      if (tissue_) found_[kAcross].why = found_[kWithin].why = "the number of cells changes";
      tissue_.reset();
      unit_corners_ = 0;
      return;
    }
    for (int32_t unit = 0; unit < units_; ++unit) {
      bool exists = exists_[at(unit_particle(unit))] != 0;
      for (int k = 1; k < unit_corners_; ++k)
        exists &= exists_[at(coupling_.cells[at(unit) * at(unit_corners_) + at(k)])] != 0;
      if (!exists) tissue_->remove(unit);
    }
    if (is_new_gone_) last_cut_ = frame_;
    if (!frame.blade.empty() && !was_places_.empty()) {
      std::vector<Vec3> is = places(frame.positions);
      double farthest = 0;
      for (const Vec3 x : is) farthest = std::max(farthest, norm(x));
      const int64_t cut_before = tissue_->surely_cut();
      tissue_->sweep(frame.blade, was_places_, is, header_.cut_resolution + 8 * header_.u * farthest);
      if (tissue_->surely_cut() > cut_before) last_cut_ = frame_;
      was_places_ = std::move(is);
      return;
    }
    was_places_ = places(frame.positions);
  }
  std::vector<Vec3> places(std::span<const Vec3> x) const {
    std::vector<Vec3> all;
    for (int32_t unit = 0; unit < units_; ++unit) {
      const Vec3 place = place_of(x, unit);
      all.push_back(is_number(place) ? place : Vec3{});
    }
    return all;
  }

  // Components of the coupling, by particle.
  std::vector<int32_t> coupled() {
    DisjointSets sets(n_);
    const auto join = [&](std::span<const int32_t> members, std::span<const double> weights) {
      int32_t first = -1;
      for (std::size_t k = 0; k < members.size(); ++k) {
        const int32_t i = members[k];
        if (exists_[at(i)] == 0 || (!weights.empty() && !(std::abs(weights[k]) > header_.u))) continue;
        if (first >= 0) sets.unite(first, i);
        first = i;
      }
    };
    const auto weights = std::span(coupling_.weights);
    for (std::size_t g = 0; g + 1 < coupling_.offsets.size(); ++g) {
      const auto begin = at(coupling_.offsets[g]), count = at(coupling_.offsets[g + 1]) - begin;
      join(std::span(coupling_.members).subspan(begin, count),
           weights.empty() ? weights : weights.subspan(begin, count));
    }
    for (std::size_t begin = 0; coupling_.corners > 0 && begin < coupling_.cells.size(); begin += at(coupling_.corners))
      join(std::span(coupling_.cells).subspan(begin, at(coupling_.corners)), {});
    std::vector<int32_t> label(at(n_));
    coupled_count_ = 0;
    for (int32_t i = 0; i < n_; ++i) {
      label[at(i)] = sets.find(i);
      coupled_count_ += exists_[at(i)] != 0 && label[at(i)] == i;
    }
    return label;
  }

  // Two particles of one group that lie in different pieces; -1 if there are none, as of cells.
  // Two units of tissue; particles that were added later are none.
  std::array<int32_t, 2> parted_in_a_group(const SweptTissue::Pieces& apart) const {
    for (std::size_t g = 0; !by_cells() && g + 1 < coupling_.offsets.size(); ++g) {
      int32_t first = -1;
      for (auto k = at(coupling_.offsets[g]); k < at(coupling_.offsets[g + 1]); ++k) {
        const int32_t i = coupling_.members[k];
        const bool is_joined = coupling_.weights.empty() || std::abs(coupling_.weights[k]) > header_.u;
        if (i >= units_ || !is_joined || apart.label[at(i)] < 0 || tissue_->is_beside(i)) continue;
        if (first >= 0 && apart.label[at(first)] != apart.label[at(i)]) return {first, i};
        first = i;
      }
    }
    return {-1, -1};
  }

  void partitions() {
    const std::vector<int32_t> label = coupled();
    const SweptTissue::Pieces apart = tissue_->apart();
    struct Part {
      int64_t units = 0;
      int32_t first = -1;
    };
    std::map<int32_t, std::map<int32_t, Part>> parts;  // of each component of the coupling, by piece
    for (int32_t unit = 0; unit < units_; ++unit) {
      const int32_t piece = apart.label[at(unit)];
      if (piece < 0 || tissue_->is_beside(unit)) continue;
      Part& part = parts[label[at(unit_particle(unit))]][piece];
      if (part.units++ == 0) part.first = unit;
    }
    // Units that are in no body's largest piece.
    int64_t across = 0;
    std::array<int32_t, 2> example = {-1, -1};
    for (const auto& [component, of] : parts) {
      const auto largest = std::max_element(
          of.begin(), of.end(), [](const auto& a, const auto& b) { return a.second.units < b.second.units; });
      for (auto part = of.begin(); part != of.end(); ++part) {
        if (part == largest) continue;
        if (across == 0) example = {unit_particle(largest->second.first), unit_particle(part->second.first)};
        across += part->second.units;
      }
    }
    const char *const one = by_cells() ? "cell" : "particle", *const several = by_cells() ? "cells" : "particles";
    if (!within(kAcross, static_cast<double>(across), 0)) {
      const std::array<int32_t, 2> direct = parted_in_a_group(apart);
      const auto [a, b] = direct[0] >= 0 ? direct : example;
      fail(kAcross, {{}, {a, b}},
           "{} of {} {} coupled to another piece in frame {}. For example, {} joins particles {} and {}, which {}",
           across, counted(units_, one, several), across == 1 ? "is" : "are", frame_,
           direct[0] >= 0 ? "one coupling group"
           : by_cells()   ? "a chain of cells"
                          : "a chain of coupling groups",
           a, b, has_blade_ ? "the blade has parted" : "no tissue connects");
    }
    const SweptTissue::Pieces together = tissue_->together();
    std::vector<int32_t> component_of(at(together.count), -1), first(at(together.count), -1);
    int64_t torn = 0;
    for (int32_t unit = 0; unit < units_; ++unit) {
      const int32_t piece = together.label[at(unit)];
      if (piece < 0) continue;
      const int32_t component = label[at(unit_particle(unit))];
      if (first[at(piece)] < 0) {
        first[at(piece)] = unit;
        component_of[at(piece)] = component;
      } else if (component_of[at(piece)] != component) {
        if (++torn == 1) example = {unit_particle(first[at(piece)]), unit_particle(unit)};
      }
    }
    if (!within(kWithin, static_cast<double>(torn), 0))
      fail(kWithin, {{}, {example[0], example[1]}},
           "{} of {} {} no longer coupled to the rest of the piece in frame {}, for example {} to {}; no blade has "
           "been between them",
           torn, counted(units_, one, several), torn == 1 ? "is" : "are", frame_, example[1], example[0]);
  }

  // What the simulator says is a piece lies in one piece, and joins what nothing has cut.
  void said(const RunFrame& frame) {
    if (!tissue_) return;
    const SweptTissue::Pieces apart = tissue_->apart(), together = tissue_->together();
    std::map<int32_t, int32_t> seen;
    std::vector<std::optional<int32_t>> word(at(together.count));
    int64_t wrong = 0;
    int32_t example = -1;
    std::string why;
    for (int32_t unit = 0; unit < units_; ++unit) {
      if (apart.label[at(unit)] < 0) continue;
      const int32_t particle = unit_particle(unit), name = frame.piece[at(particle)];
      if (!tissue_->is_beside(unit)) {
        const auto [known, is_new] = seen.emplace(name, apart.label[at(unit)]);
        if (!is_new && known->second != apart.label[at(unit)]) {
          if (++wrong == 1) {
            example = particle;
            why = fmt::format("piece {} has particles on both sides of a cut, such as {}", name, particle);
          }
        }
      }
      std::optional<int32_t>& one = word[at(together.label[at(unit)])];
      if (!one) one = name;
      if (*one != name) {
        if (++wrong == 1) {
          example = particle;
          why = fmt::format("particle {} is in piece {}, and is joined to piece {} by whole tissue", particle, name,
                            *one);
        }
      }
    }
    if (!within(kSaid, static_cast<double>(wrong), 0))
      fail(kSaid, {{}, {example}}, "piece numbers contradict the cut {} in frame {}. For example, {}",
           counted(wrong, "time", "times"), frame_, why);
  }

  const RunHeader header_;
  std::vector<double> mass_, mass_was_;  // [n] of this frame, and of the last one of which it was given
  std::vector<Found> found_;
  std::vector<std::string> notes_;
  RunCoupling coupling_;
  int64_t largest_group_ = 0, largest_plane_ = 1;  // particles: in a group; with equal coordinates in the first frame
  bool is_coupled_ = false, is_new_coupling_ = false, is_new_gone_ = false, is_new_mass_ = false, has_blade_ = false;
  int64_t frame_ = 0, frames_ = 0, n_ = 0, coupled_count_ = 0, last_cut_ = -1;
  std::vector<uint8_t> exists_, existed_, ever_;  // [n]
  std::vector<int32_t> parent_;                   // [n] of each when it was new
  std::vector<Vec3> was_, velocity_was_, spin_was_, was_places_;
  std::optional<double> time_was_, energy_was_, volume_at_rest_;
  std::optional<SweptTissue> tissue_;
  int32_t units_ = 0, pieces_at_first_ = 0;
  int unit_corners_ = 0;  // 0: units are particles
  double fastest_ = 0;    // of the velocities about their mean, in all frames so far
  double lost_ = 0;       // greatest share of the angular momentum that a frame loses
  int64_t lost_at_ = 0;
};

RunJudge::RunJudge(RunHeader header) : self_(std::make_unique<Implementation>(std::move(header))) {}
RunJudge::~RunJudge() = default;
void RunJudge::couple(RunCoupling coupling) { self_->couple(std::move(coupling)); }
void RunJudge::weigh(std::vector<double> mass) { self_->weigh(std::move(mass)); }
void RunJudge::see(const RunFrame& frame) { self_->see(frame); }
void RunJudge::finish() { self_->finish(); }
std::vector<Verdict> RunJudge::verdicts() const { return self_->verdicts(); }
std::vector<RunJudge::NotAsked> RunJudge::not_asked() const { return self_->not_asked(); }
std::vector<std::string> RunJudge::notes() const { return self_->notes(); }
std::vector<int32_t> RunJudge::piece_of_particles(bool touched_is_cut) const {
  return self_->piece_of_particles(touched_is_cut);
}
RunPieces RunJudge::pieces() const { return self_->pieces(); }

}  // namespace cutproof::oracles
