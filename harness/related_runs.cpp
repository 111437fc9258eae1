#include "harness/related_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>

#include "harness/run_frames.h"
#include "model/at.h"
#include "model/error.h"

namespace cutproof::harness {

namespace {

using oracles::RelatedRun;
using oracles::RunCoupling;

// One run where it is, with the coupling that holds.
class OpenRun {
 public:
  explicit OpenRun(const std::string& path) : OpenRun(path, io::RunSegments::of(path)) {}
  OpenRun(std::string name, io::RunSegments segments) : path_(std::move(name)), frames_(std::move(segments)) {}

  bool next() {
    if (!frames_.next()) return false;
    if (!frames_.begins_segment()) return true;
    if (std::vector<double> mass = frames_.segment().mass(); !mass.empty()) mass_ = std::move(mass);
    return true;
  }
  const std::string& path() const { return path_; }
  const RunSegment& segment() const { return frames_.segment(); }
  const oracles::RunHeader& header() const { return frames_.header(); }
  const std::vector<double>& mass() const { return mass_; }
  RelatedRun where() const { return {frames_.frame(), frames_.coupling(), frames_.has_new_coupling()}; }

 private:
  std::string path_;
  RunFrames frames_;
  std::vector<double> mass_;
};

// Several bodies that were run alone, as one run: particles of the first, then of the next.
class Together {
 public:
  explicit Together(const std::vector<std::unique_ptr<OpenRun>>& runs) : runs_(runs) {}

  oracles::RunHeader header() const {
    oracles::RunHeader all = runs_.front()->header();
    for (std::size_t k = 1; k < runs_.size(); ++k) {
      const oracles::RunHeader& more = runs_[k]->header();
      all.rest.insert(all.rest.end(), more.rest.begin(), more.rest.end());
      all.u = std::max(all.u, more.u);
    }
    return all;
  }
  std::vector<double> mass() const {
    std::vector<double> all;
    for (const auto& run : runs_) all.insert(all.end(), run->mass().begin(), run->mass().end());
    return all;
  }
  // Of the frames where they are; valid until the next call.
  RelatedRun where() {
    if (runs_.size() == 1) return runs_.front()->where();
    RelatedRun all;
    coupling_ = {};
    coupling_.offsets = {0};
    positions_.clear(), velocities_.clear(), spin_.clear(), blade_.clear();
    exists_.clear();
    bool is_coupled = true;
    for (const auto& run : runs_) {
      const RelatedRun one = run->where();
      const auto shift = static_cast<int32_t>(std::ssize(positions_));
      all.frame.index = one.frame.index;
      all.frame.time = one.frame.time;
      append(positions_, one.frame.positions), append(velocities_, one.frame.velocities);
      append(spin_, one.frame.spin);
      if (blade_.empty()) append(blade_, one.frame.blade);  // the same blade cuts each body
      for (std::size_t i = 0; i < one.frame.positions.size(); ++i) {
        exists_.push_back(oracles::exists(one.frame, i));
      }
      all.is_new_coupling = all.is_new_coupling || one.is_new_coupling;
      is_coupled = is_coupled && one.coupling != nullptr;
      if (one.coupling != nullptr) append(coupling_, *one.coupling, shift);
    }
    all.frame.positions = positions_;
    if (velocities_.size() == positions_.size()) all.frame.velocities = velocities_;
    if (spin_.size() == positions_.size()) all.frame.spin = spin_;
    all.frame.blade = blade_;
    all.frame.alive = exists_;
    if (is_coupled) all.coupling = &coupling_;
    return all;
  }

 private:
  static void append(std::vector<Vec3>& to, std::span<const Vec3> more) {
    to.insert(to.end(), more.begin(), more.end());
  }
  static void append(RunCoupling& to, const RunCoupling& more, int32_t shift) {
    const int64_t before = std::ssize(to.members);
    for (std::size_t g = 1; g < more.offsets.size(); ++g) to.offsets.push_back(before + more.offsets[g]);
    for (const int32_t i : more.members) to.members.push_back(i + shift);
    for (const int32_t i : more.cells) to.cells.push_back(i + shift);
    if (more.corners > 0) to.corners = more.corners;
  }

  const std::vector<std::unique_ptr<OpenRun>>& runs_;
  std::vector<Vec3> positions_, velocities_, spin_, blade_;
  std::vector<uint8_t> exists_;
  RunCoupling coupling_;
};

struct HashOfPlace {
  std::size_t operator()(Vec3 x) const {
    std::size_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) hash = 31 * hash + std::hash<double>()(x[axis] + 0.0);  // -0 is 0
    return hash;
  }
};

// Of each particle of the second run, which one of the first it is: as it says, or by where it rests.
std::vector<int32_t> permutation_of(const OpenRun& a, const OpenRun& b) {
  const int64_t n = b.segment().particles();
  const NamedArrays& arrays = b.segment().arrays();
  if (const Array* const given = arrays.find("permutation", {n})) {
    const std::vector<int32_t> was = arrays.integers(*given);
    std::vector<uint8_t> taken(at(n));
    for (const int32_t i : was) {
      if (i < 0 || i >= n || taken[at(i)]++ != 0)
        arrays.refuse("permutation", fmt::format("It names particle {} twice, or there is no such particle.", i),
                      "Name each particle once.");
    }
    return was;
  }
  const std::vector<Vec3>&rest = a.header().rest, &mixed = b.header().rest;
  if (rest.empty() || rest.size() != mixed.size())
    throw InputError(b.path(), "permutation", "The correspondence of particles is missing.",
                     "Write permutation, or rest in both.");
  std::unordered_map<Vec3, int32_t, HashOfPlace> by_place;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (!by_place.emplace(rest[i], static_cast<int32_t>(i)).second)
      throw InputError(b.path(), "permutation", fmt::format("Particle {} rests where another one does.", i),
                       "Write permutation.");
  }
  std::vector<int32_t> was;
  for (std::size_t i = 0; i < mixed.size(); ++i) {
    const auto found = by_place.find(mixed[i]);
    if (found == by_place.end())
      throw InputError(b.path(), "rest", fmt::format("Particle {} rests where none of the first run does.", i),
                       "Write permutation.");
    was.push_back(found->second);
    by_place.erase(found);
  }
  return was;
}

// How many of the runs have another frame, to which each goes.
int64_t all_next(const std::vector<std::unique_ptr<OpenRun>>& runs) {
  int64_t there = 0;
  for (const auto& run : runs) there += run->next();
  return there;
}

// A run that was loaded from a checkpoint begins in the middle of the first one, to where this goes. Returns how many
// of the disturbed runs are there, too.
int64_t go_to_checkpoint(OpenRun& first, const OpenRun& later, const std::vector<std::unique_ptr<OpenRun>>& noise) {
  int64_t in_noise = std::ssize(noise);
  for (;;) {
    const RelatedRun now = first.where();
    const std::optional<double> begins = later.where().frame.time;
    if (!now.frame.time || !begins)
      throw InputError(first.path(), "time", "The times of frames are missing.", "Write time in both.");
    // Sums of steps round.
    const double rounds = 4 * std::max(first.header().u, later.header().u) *
                          static_cast<double>((now.frame.index + 1) * first.header().steps) * std::abs(*begins);
    if (*now.frame.time >= *begins - rounds) return in_noise;
    if (!first.next())
      throw InputError(later.path(), "time", "It begins after the first run ends.", "Write a longer one.");
    in_noise = all_next(noise);
  }
}

JudgedRelation judge_refinement(const RelatedFiles& files, const std::function<void(int64_t)>& frame_done) {
  std::vector<std::unique_ptr<OpenRun>> runs;
  runs.push_back(std::make_unique<OpenRun>(files.first));
  for (const std::string& path : files.others) runs.push_back(std::make_unique<OpenRun>(path));
  JudgedRelation judged;
  std::optional<oracles::RunRefinement> refinement;
  for (;;) {
    const int64_t there = all_next(runs);
    if (refinement && there != std::ssize(runs)) {
      if (there > 0) refinement->see_end_of_some(judged.frames);
      break;
    }
    if (!refinement) {
      std::vector<oracles::RunHeader> headers;
      for (const auto& run : runs) {
        headers.push_back(run->header());
        if (headers.size() > 1 && headers.back().steps <= headers[headers.size() - 2].steps)
          run->segment().arrays().refuse("steps", "It has no more substeps in a frame than the run before.",
                                         "Write steps, and give the coarsest run first.");
      }
      refinement.emplace(headers);
      judged.particles = runs.front()->segment().particles();
    }
    std::vector<RelatedRun> now;
    for (const auto& run : runs) now.push_back(run->where());
    refinement->see(now);
    if (frame_done) frame_done(judged.frames);
    ++judged.frames;
  }
  judged.verdicts = refinement->verdicts();
  judged.differences = refinement->differences();
  return judged;
}

// By a map other than `refine`.
JudgedRelation judge_related(const oracles::RunMap& map, OpenRun& first,
                             const std::vector<std::unique_ptr<OpenRun>>& others,
                             const std::vector<std::unique_ptr<OpenRun>>& noise, bool bits,
                             const std::function<void(int64_t)>& frame_done) {
  Together second(others);
  std::optional<oracles::RunRelation> relation;
  JudgedRelation judged;
  for (;;) {
    const bool in_first = first.next();
    const int64_t in_others = all_next(others);
    int64_t in_noise = all_next(noise);
    if (!relation) {
      if (map.name() == "checkpoint") in_noise = go_to_checkpoint(first, *others.front(), noise);
      relation.emplace(map, first.header(), second.header(), static_cast<int>(noise.size()), bits);
      judged.particles = first.segment().particles();
    }
    const bool all = in_first && in_others == std::ssize(others) && in_noise == std::ssize(noise);
    if (!all) {
      if (in_first || in_others > 0 || in_noise > 0) relation->see_end_of_some(judged.frames);
      break;
    }
    if (map.needs_time() && !first.where().frame.time)
      throw InputError(first.path(), "time", "A boost needs the times of frames.", "Write time.");
    if (judged.frames == 0) {
      if (map.name() == "permute") relation->permute(judged.permutation = permutation_of(first, *others.front()));
      relation->weigh(first.mass(), second.mass());
    }
    std::vector<RelatedRun> disturbed;
    for (const auto& run : noise) disturbed.push_back(run->where());
    relation->see(first.where(), second.where(), disturbed);
    if (frame_done) frame_done(judged.frames);
    ++judged.frames;
  }
  relation->finish();
  judged.verdicts = relation->verdicts();
  for (const auto& [property, why] : relation->not_asked()) judged.not_judged.push_back({property, why});
  judged.notes = relation->notes();
  judged.sharpest = relation->sharpest();
  return judged;
}

}  // namespace

bool JudgedRelation::holds() const {
  return std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& verdict) { return verdict.holds; });
}

JudgedRelation judge_relation(const oracles::RunMap& map, const RelatedFiles& files,
                              const std::function<void(int64_t)>& frame_done) {
  if (map.name() == "refine") return judge_refinement(files, frame_done);
  OpenRun first(files.first);
  std::vector<std::unique_ptr<OpenRun>> others, noise;
  for (const std::string& path : files.others) others.push_back(std::make_unique<OpenRun>(path));
  for (const std::string& path : files.noise) noise.push_back(std::make_unique<OpenRun>(path));
  return judge_related(map, first, others, noise, files.bits, frame_done);
}

JudgedRelation judge_relation(const oracles::RunMap& map, io::RunSegments first, io::RunSegments second,
                              std::vector<io::RunSegments> noise) {
  OpenRun one("the first run", std::move(first));
  std::vector<std::unique_ptr<OpenRun>> others, disturbed;
  others.push_back(std::make_unique<OpenRun>("the second run", std::move(second)));
  for (io::RunSegments& run : noise) disturbed.push_back(std::make_unique<OpenRun>("a disturbed run", std::move(run)));
  return judge_related(map, one, others, disturbed, false, {});
}

}  // namespace cutproof::harness
