#include "report/pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include "model/at.h"
#include "model/io/json_number.h"
#include "model/verdict.h"
#include "report/beside.h"
#include "report/changes.h"
#include "report/coding.h"
#include "report/pieces.h"

namespace cutproof::report {

namespace {

using nlohmann::json;

// Bytes of a chunk before it is compressed, and its moments: little enough to be inflated while somebody scrubs.
constexpr std::size_t kChunkBytes = std::size_t{12} << 20;
constexpr std::size_t kChunkMoments = 16;
// Nobody looks at more frames than these, so particles are thinned as well rather than frames beyond it.
constexpr int64_t kFewestFrames = 40;
// A box reaches so many times the body's size beyond the body: what has flown farther would cost all others their
// places.
constexpr double kReach = 8;

// What a moment shows, of kept particles only; an empty list is as it was in the moment before.
struct Picture {
  std::vector<Vec3> x, skin;
  std::vector<uint8_t> alive, holders;
  std::vector<uint8_t> change, apart;  // what is not there is nothing, whatever the moment before had
  std::vector<int32_t> cluster, piece, owner, triangles;
  bool has_skin = false, has_owner = false, has_triangles = false;
};

// The particles that are kept, and their numbers on the page.
struct Kept {
  std::vector<int32_t> particle;  // ascending
  std::vector<int32_t> place;     // [n] on the page; of one that is not kept, of the next one that is
};

Kept kept_particles(int32_t n, int32_t every, const std::vector<Marks>& named) {
  std::vector<uint8_t> keep(at(n), 0);
  for (int32_t i = 0; i < n; i += every) keep[at(i)] = 1;
  for (const Marks& marks : named) {
    for (const auto* list : {&marks.particles, &marks.path, &marks.clusters}) {
      for (const int32_t particle : *list) keep[at(particle)] = 1;
    }
  }
  Kept kept;
  kept.place.resize(at(n));
  for (int32_t i = 0; i < n; ++i) {
    kept.place[at(i)] = static_cast<int32_t>(kept.particle.size());
    if (keep[at(i)] != 0) kept.particle.push_back(i);
  }
  // Particles behind the last that is kept.
  for (int32_t& place : kept.place) place = std::min(place, static_cast<int32_t>(kept.particle.size()) - 1);
  return kept;
}

template <class T>
std::vector<T> only(const std::vector<T>& all, const Kept& kept) {
  std::vector<T> some;
  some.reserve(kept.particle.size());
  for (const int32_t particle : kept.particle) some.push_back(all[at(particle)]);
  return some;
}

// The skin of a state that may be as wrong as it likes: triangles of vertices that are there, owners that are.
void add_skin(Picture& picture, const State& state, const Kept& kept) {
  const Skin& skin = state.skin;
  picture.has_skin = picture.has_owner = picture.has_triangles = true;
  picture.skin = skin.position;
  const auto vertices = static_cast<int32_t>(skin.position.size());
  for (const int32_t owner : skin.owner) {
    const bool is_there = owner >= 0 && owner < std::ssize(kept.place);
    picture.owner.push_back(is_there ? kept.place[at(owner)] : -1);
  }
  picture.owner.resize(skin.position.size(), -1);
  for (const auto& triangle : skin.triangles) {
    if (std::all_of(triangle.begin(), triangle.end(), [&](int32_t v) { return v >= 0 && v < vertices; }))
      picture.triangles.insert(picture.triangles.end(), triangle.begin(), triangle.end());
  }
}

void widen(Box& box, Vec3 point) {
  if (!is_finite(point)) return;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::min(box.low[axis], point[axis]);
    box.high[axis] = std::max(box.high[axis], point[axis]);
  }
}
constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr Box kNothing = {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
Box or_origin(const Box& box) { return box.low.x <= box.high.x ? box : Box{{}, {}}; }

// Around the body at rest, with room: no chunk's box is larger.
Box outer_box(const Body& body) {
  Box box = kNothing;
  for (int32_t i = 0; i < body.particle_count(); ++i) widen(box, body.rest_position(i));
  box = or_origin(box);
  const Vec3 size = box.high - box.low;
  const double reach = kReach * std::max({size.x, size.y, size.z, body.grid.spacing});
  return {box.low - Vec3{reach, reach, reach}, box.high + Vec3{reach, reach, reach}};
}
bool is_within(Vec3 p, const Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(p[axis] >= box.low[axis] && p[axis] <= box.high[axis])) return false;  // NaN too
  }
  return true;
}

// Writes a chunk: a length of four bytes, a description in JSON, and the arrays that it describes.
class Chunk {
 public:
  bool is_empty() const { return pictures_.empty(); }
  bool is_full() const { return pictures_.size() >= kChunkMoments || size_ >= kChunkBytes; }
  void add(Picture picture) {
    size_ += 6 * (picture.x.size() + picture.skin.size()) + 4 * (picture.cluster.size() + picture.triangles.size());
    pictures_.push_back(std::move(picture));
  }
  // base64; empties it. `edges`: ends of each, only of the first chunk.
  std::string finish(const Box& outer, const std::vector<int32_t>& edge_a, const std::vector<int32_t>& edge_b,
                     Chunks& result, double spacing) {
    Box box = kNothing;
    for (const Picture& picture : pictures_) {
      for (const auto* points : {&picture.x, &picture.skin}) {
        for (const Vec3 point : *points) {
          if (is_within(point, outer)) widen(box, point);
        }
      }
    }
    box = or_origin(box);
    result.loss = std::max(result.loss, spacing > 0 ? loss(box) / spacing : 0);
    json head = {{"low", {box.low.x, box.low.y, box.low.z}}, {"high", {box.high.x, box.high.y, box.high.z}}};
    json moments = json::array();
    std::string bytes;
    if (!edge_a.empty()) {
      head["edges"] = {bytes.size(), edge_a.size()};
      append_integers(bytes, edge_a);
      append_integers(bytes, edge_b);
    }
    std::vector<uint16_t> before_x, before_skin;
    for (const Picture& picture : pictures_) {
      json one = json::object();
      const auto add_points = [&](const char* name, const std::vector<Vec3>& points, std::vector<uint16_t>& before) {
        std::vector<uint16_t> steps = steps_of(points, box);
        const bool is_difference = before.size() == steps.size();
        one[name] = {bytes.size(), points.size(), is_difference ? 1 : 0};
        append_steps(bytes, steps, is_difference ? before : std::vector<uint16_t>());
        before = std::move(steps);
      };
      const auto add_integers = [&](const char* name, const std::vector<int32_t>& values) {
        one[name] = {bytes.size(), values.size()};
        append_integers(bytes, values);
      };
      if (!picture.x.empty()) {
        add_points("x", picture.x, before_x);
      }
      if (!picture.alive.empty()) {
        one["alive"] = {bytes.size(), picture.alive.size()};
        append_flags(bytes, picture.alive);
        add_integers("piece", picture.piece);
      }
      if (!picture.cluster.empty()) {
        add_integers("cluster", picture.cluster);
        one["holders"] = {bytes.size(), picture.holders.size()};
        bytes.append(reinterpret_cast<const char*>(picture.holders.data()), picture.holders.size());
      }
      for (const auto& [name, codes] : {std::pair{"change", &picture.change}, std::pair{"apart", &picture.apart}}) {
        if (std::all_of(codes->begin(), codes->end(), [](uint8_t code) { return code == 0; })) continue;
        one[name] = {bytes.size(), codes->size()};
        bytes.append(reinterpret_cast<const char*>(codes->data()), codes->size());
      }
      if (picture.has_skin) {
        add_points("skin", picture.skin, before_skin);
        if (picture.has_owner) add_integers("owner", picture.owner);
        if (picture.has_triangles) add_integers("triangles", picture.triangles);
      }
      moments.push_back(std::move(one));
    }
    head["moments"] = std::move(moments);
    const std::string text = head.dump();
    std::string whole;
    for (std::size_t k = 0; k < 4; ++k) whole += static_cast<char>(text.size() >> (8 * k) & 0xFF);
    whole += text;
    whole += bytes;
    pictures_.clear();
    size_ = 0;
    return base64(gzip(whole));
  }

 private:
  std::vector<Picture> pictures_;
  std::size_t size_ = 0;
};

json point_json(Vec3 p) { return {p.x, p.y, p.z}; }

json pose_json(const Setup& setup, const Moment& moment) {
  const BladePose* const pose = moment.is_start ? nullptr : last_lowered(setup, moment.frame);
  if (pose == nullptr) return nullptr;
  return {point_json(pose->edge), point_json(pose->along), point_json(pose->back)};
}

// Patches of the blade's sweep that a page draws of one moment at most, and of all moments.
constexpr std::size_t kMostPatches = 500, kPatchesOfPage = 20'000;

// Of the particles alive in a state: how many no page draws, because they are not finite or far outside; and of the
// others the middle, and how far they reach from it along each axis [m].
void add_extent(json& detail, const State& state, const Box& outer) {
  Vec3 sum, half;
  int64_t count = 0, nowhere = 0, no_number = 0;
  const auto each = [&](const auto& see) {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (state.alive[i] != 0) see(state.x[i], is_within(state.x[i], outer));
    }
  };
  each([&](Vec3 x, bool is_drawn) {
    if (is_drawn) sum = sum + x;
    ++(is_drawn ? count : nowhere);
    no_number += !std::isfinite(dot(x, x));
  });
  const Vec3 middle = sum / static_cast<double>(std::max<int64_t>(count, 1));
  each([&](Vec3 x, bool is_drawn) {
    for (int axis = 0; axis < 3 && is_drawn; ++axis)
      half[axis] = std::max(half[axis], std::abs(x[axis] - middle[axis]));
  });
  detail["nowhere"] = nowhere;
  detail["noNumber"] = no_number;
  if (count > 0) {
    detail["middle"] = point_json(middle);
    detail["half"] = point_json(half);
  }
}

// Of what the blade has swept since the moment before; what is too much is left out evenly.
json swept_json(const std::vector<Vec3>& corners, std::size_t most, int64_t& left_out) {
  std::vector<std::size_t> patches;
  for (std::size_t k = 0; k + 4 <= corners.size(); k += 4) {
    if (std::all_of(&corners[k], &corners[k] + 4, [](Vec3 x) {
          return std::isfinite(static_cast<float>(x.x)) && std::isfinite(static_cast<float>(x.y)) &&
                 std::isfinite(static_cast<float>(x.z));
        }))
      patches.push_back(k);
  }
  json list = json::array();
  const std::size_t shown = std::min(patches.size(), most);
  for (std::size_t n = 0; n < shown; ++n) {
    for (std::size_t c = 0; c < 4; ++c) {
      for (int axis = 0; axis < 3; ++axis)
        list.push_back(static_cast<float>(corners[patches[n * patches.size() / shown] + c][axis]));
    }
  }
  left_out += static_cast<int64_t>(patches.size() - shown);
  return list;
}

json detail(const Setup& setup, const Moment& moment, const State& state, int32_t pieces, int64_t alive) {
  return {{"frame", moment.frame},
          {"stage", name_of(moment.stage)},
          {"start", moment.is_start},
          {"particles", alive},
          {"clusters", state.clusters.number.size()},
          {"components", pieces},
          {"removed", state.removed.size() + state.debris.size()},
          {"blade", pose_json(setup, moment)}};
}

// The moment that shows a finding: after its stage in its frame, or the next one that there is.
std::pair<int64_t, bool> moment_of(const std::vector<Moment>& moments, const Finding& finding) {
  for (std::size_t k = 0; k < moments.size(); ++k) {
    const Moment& moment = moments[k];
    if (moment.is_start) continue;
    if (moment.frame == finding.frame && moment.stage >= finding.stage)
      return {static_cast<int64_t>(k), moment.stage == finding.stage};
    if (moment.frame > finding.frame) return {static_cast<int64_t>(k), false};
  }
  return {moments.empty() ? -1 : static_cast<int64_t>(moments.size()) - 1, false};
}

struct Survey {
  std::vector<Moment> moments;
  std::vector<FrameEnd> frames;
  Box reach = kNothing;
};

// Walks all snapshots once.
Survey survey_of(const Source& source) {
  Survey survey;
  Pieces pieces;
  std::vector<uint8_t> alive;
  const Box outer = outer_box(source.setup.body);
  for (int64_t i = 0; i < source.count; ++i) {
    const io::Snapshot snapshot = source.snapshot(i);
    const State& state = snapshot.state;
    const bool is_end = snapshot.stage == Stage::skin;
    const bool is_start = i == 0 && !source.is_foreign();
    survey.moments.push_back({i, state.frame - (!is_start && is_end ? 1 : 0), snapshot.stage, is_start});
    if (!is_end) continue;
    const bool is_new = i == 0 || state.alive != alive;
    if (is_new) alive = state.alive;
    if (source.is_foreign()) {
      pieces = pieces_of(source.of_run(i).piece);
    } else if (is_new) {
      pieces = pieces_of(source.setup.body, alive);
    }
    for (std::size_t p = 0; p < state.x.size(); ++p) {
      if (alive[p] != 0 && is_within(state.x[p], outer)) widen(survey.reach, state.x[p]);
    }
    const int64_t removed = std::ssize(state.removed) + std::ssize(state.debris);
    survey.frames.push_back(
        {is_start ? -1 : state.frame - 1, std::count_if(alive.begin(), alive.end(), [](uint8_t a) { return a != 0; }),
         std::ssize(state.clusters.number), pieces.count, std::ssize(state.skin.triangles), removed});
  }
  return survey;
}

// How many particles are marked: of a finding in each of its lists, and of all findings together before each has few.
constexpr std::size_t kMostMarks = 2000, kFewMarks = 60, kManyMarks = 80'000;
// Lines between the members of more would hide what they join.
constexpr std::size_t kMostJoined = 24;

std::vector<int32_t> within(const std::vector<int32_t>& particles, int32_t n, std::size_t most, Marks& marks) {
  std::vector<int32_t> found;
  for (const int32_t particle : particles) {
    if (particle < 0 || particle >= n) continue;
    if (found.size() == most) {
      marks.is_partly = true;
      break;
    }
    found.push_back(particle);
  }
  return found;
}

// Of each finding, with particles as the body numbers them.
std::vector<Marks> marks_of(const Source& source, const std::vector<Moment>& moments,
                            const std::vector<Finding>& findings) {
  const int32_t n = source.setup.body.particle_count();
  std::vector<Marks> all;
  int64_t read = -1;
  io::Snapshot snapshot;
  std::size_t marked = 0;
  for (const Finding& finding : findings) {
    Marks marks;
    const std::size_t most = marked < kManyMarks ? kMostMarks : kFewMarks;
    std::tie(marks.moment, marks.is_exact) = moment_of(moments, finding);
    marks.particles = within(finding.particles, n, most, marks);
    marks.path = within(finding.path, n, most, marks);
    if (marks.moment >= 0 && !finding.clusters.empty()) {
      if (const int64_t index = moments[at(marks.moment)].snapshot; index != read) {
        snapshot = source.snapshot(index);
        read = index;
      }
      std::set<int32_t> members;
      for (const int32_t cluster : finding.clusters) {
        std::vector<int32_t> of_it = members_of(snapshot.state.clusters, cluster, n);
        members.insert(of_it.begin(), of_it.end());
        if (!of_it.empty()) marks.joined.push_back({cluster, std::move(of_it)});
        if (members.size() > most) break;
      }
      if (members.size() > std::min(most, kMostJoined)) marks.joined.clear();
      marks.clusters = within({members.begin(), members.end()}, n, most, marks);
    }
    if (marks.moment >= 0 && !finding.triangles.empty()) {
      if (const int64_t index = moments[at(marks.moment)].snapshot; index != read) {
        snapshot = source.snapshot(index);
        read = index;
      }
      const Skin& skin = snapshot.state.skin;
      for (const int32_t t : finding.triangles) {
        if (t < 0 || t >= std::ssize(skin.triangles)) continue;
        if (std::ssize(marks.corners) >= 3 * kMostWitnessTriangles) {
          marks.is_partly = true;
          break;
        }
        const auto& corners = skin.triangles[at(t)];
        if (std::all_of(corners.begin(), corners.end(),
                        [&](int32_t v) { return v >= 0 && v < std::ssize(skin.position); }))
          marks.corners.insert(marks.corners.end(), corners.begin(), corners.end());
      }
    }
    marked += marks.particles.size() + marks.path.size() + marks.clusters.size();
    all.push_back(std::move(marks));
  }
  return all;
}

// What all drawings of a page have in common, however much they are thinned.
struct Plan {
  const Source& source;
  const Beside* beside;  // or null
  const std::vector<Finding>& findings;
  Survey survey;
  std::vector<Marks> marks;
  std::vector<Together> moments;  // of both runs, or of the one that there is
  std::set<int64_t> named;        // frames of which every stage is kept
  json comparison;
};

// Snapshots of one run, one after the other. The one that was asked for last is at hand, and the one before it, so that
// a walk reads each once.
class Walk {
 public:
  explicit Walk(const Source& source) : source_(source) {}
  const State& at_snapshot(int64_t index) {
    if (index == index_) return now_;
    if (index_ == index - 1) {
      before_ = std::move(now_);
      before_index_ = index_;
    }
    now_ = source_.snapshot(index).state;
    index_ = index;
    return now_;
  }
  // The state of the snapshot before the one that was asked for last, which is not the first.
  const State& before() {
    if (before_index_ != index_ - 1) {
      before_ = source_.snapshot(index_ - 1).state;
      before_index_ = index_ - 1;
    }
    return before_;
  }

 private:
  const Source& source_;
  State now_, before_;
  int64_t index_ = -1, before_index_ = -2;
};

// Of the distances other than 0 that are comparable; null where there is none.
json least_and_greatest(const std::vector<uint8_t>& codes) {
  uint8_t least = kIncomparable, greatest = 0;
  for (const uint8_t code : codes) {
    if (code == 0 || code == kIncomparable) continue;
    least = std::min(least, code);
    greatest = std::max(greatest, code);
  }
  return greatest == 0 ? json() : json{least, greatest};
}

json apart_json(const Apart& apart, const Kept& kept) {
  const bool is_kept = apart.where >= 0 && std::binary_search(kept.particle.begin(), kept.particle.end(), apart.where);
  return {{"max", json_number(apart.max)}, {"rms", json_number(apart.rms)},
          {"particle", apart.where},       {"place", is_kept ? kept.place[at(apart.where)] : -1},
          {"differs", apart.differs},      {"codes", least_and_greatest(apart.codes)}};
}

// Pictures of one of the two runs at these moments. `other`: the one beside it, to which the distance is measured; null
// for none. Stretch is seen along edges, of which the first chunk holds the ends.
Chunks drawn(const Source& source, const Source* other, bool is_own, const std::vector<Together>& moments,
             const Kept& kept, const std::vector<int32_t>& edge_a, const std::vector<int32_t>& edge_b) {
  const Body& body = source.setup.body;
  Chunks result;
  const Box outer = outer_box(body);
  result.details = json::array();
  Chunk chunk;
  State before;  // of the moment before, which need not be the snapshot before
  Walk walk(source);
  std::optional<Walk> other_walk;
  if (other != nullptr) other_walk.emplace(*other);
  Pieces pieces, pieces_before;
  int64_t alive = 0, frame_before = -1;
  const std::size_t most_patches =
      std::clamp<std::size_t>(kPatchesOfPage / std::max<std::size_t>(moments.size(), 1), 8, kMostPatches);
  const auto close = [&] {
    const bool is_first = result.text.empty();
    static const std::vector<int32_t> kNone;
    result.text.push_back(
        chunk.finish(outer, is_first ? edge_a : kNone, is_first ? edge_b : kNone, result, body.grid.spacing));
    result.bytes += std::ssize(result.text.back());
  };
  for (std::size_t k = 0; k < moments.size(); ++k) {
    const Together& both = moments[k];
    const int64_t snapshot = is_own ? both.own : both.other;
    // What lies between two moments that are shown counts to the later one. (Before the state: who reads a file goes
    // on, and not back.)
    FrameOfRun of_run;
    std::vector<Vec3> swept;
    if (source.is_foreign()) {
      for (int64_t frame = frame_before + 1; frame <= snapshot; ++frame) {
        of_run = source.of_run(frame);
        swept.insert(swept.end(), of_run.swept.begin(), of_run.swept.end());
      }
      frame_before = snapshot;
    }
    const State& state = walk.at_snapshot(snapshot);
    const bool is_new = chunk.is_empty();  // the first of a chunk says everything
    if (is_new) result.first_moment.push_back(k);
    Picture picture;
    if (is_new || state.x != before.x) picture.x = only(state.x, kept);
    const bool is_other_alive = k == 0 || state.alive != before.alive;
    if (is_other_alive) alive = std::count_if(state.alive.begin(), state.alive.end(), [](uint8_t a) { return a != 0; });
    if (source.is_foreign()) {
      pieces_before = std::exchange(pieces, pieces_of(of_run.piece));
    } else if (is_other_alive) {
      pieces = pieces_of(body, state.alive);
    }
    if (is_new || is_other_alive || (source.is_foreign() && pieces.of != pieces_before.of)) {
      picture.alive = only(state.alive, kept);
      picture.piece = only(pieces.of, kept);
    }
    if (is_new || state.clusters.offsets != before.clusters.offsets ||
        state.clusters.members != before.clusters.members || (source.is_foreign() && is_other_alive)) {
      const Holders holders = holders_of(state.clusters, body.particle_count());
      picture.cluster = only(source.is_foreign() ? coupled_of(state.clusters, state.alive) : holders.lowest, kept);
      picture.holders = only(holders.count, kept);
    }
    if (is_new || state.skin != before.skin) {
      add_skin(picture, state, kept);
      picture.has_owner = is_new || state.skin.owner != before.skin.owner;
      picture.has_triangles = is_new || state.skin.triangles != before.skin.triangles;
    }
    // A moment that only the other run has changed nothing here.
    const bool is_of_this = is_own ? both.is_own : both.is_other;
    if (snapshot > 0 && is_of_this && !source.is_foreign())
      picture.change = only(changes_between(walk.before(), state), kept);
    json one = detail(source.setup, both.moment, state, pieces.count, alive);
    add_extent(one, state, outer);
    if (source.is_foreign()) {
      one["swept"] = swept_json(swept, most_patches, result.patches_left_out);
      if (of_run.time && std::isfinite(*of_run.time)) one["time"] = *of_run.time;
    }
    if (other_walk && both.is_comparable) {
      const Apart apart = apart_of(state, other_walk->at_snapshot(is_own ? both.other : both.own), body.grid.spacing);
      picture.apart = only(apart.codes, kept);
      one["apart"] = apart_json(apart, kept);
    }
    result.details.push_back(std::move(one));
    chunk.add(std::move(picture));
    before = state;
    if (k == 0 || chunk.is_full()) close();
  }
  if (!chunk.is_empty()) close();
  return result;
}

Pictures draw(const Plan& plan, Thinning thinning) {
  const Body& body = plan.source.setup.body;
  Pictures result;
  result.thinning = thinning;
  result.frames = plan.survey.frames;
  result.reach_low = or_origin(plan.survey.reach).low;
  result.reach_high = or_origin(plan.survey.reach).high;
  std::vector<Moment> all;
  for (const Together& both : plan.moments) all.push_back(both.moment);
  std::vector<Together> kept_together;
  result.moments = kept_moments(all, plan.named, thinning.every_frame);
  for (const Together& both : plan.moments) {
    const std::size_t next = kept_together.size();
    if (next < result.moments.size() && both.moment == result.moments[next]) kept_together.push_back(both);
  }
  const Kept kept = kept_particles(body.particle_count(), thinning.every_particle, plan.marks);
  result.particles = static_cast<int32_t>(kept.particle.size());
  for (Marks one : plan.marks) {
    std::tie(one.moment, one.is_exact) = moment_of(result.moments, plan.findings[result.marks.size()]);
    for (auto* list : {&one.particles, &one.path, &one.clusters}) {
      for (int32_t& particle : *list) particle = kept.place[at(particle)];
    }
    for (Marks::Cluster& cluster : one.joined) {
      for (int32_t& particle : cluster.members) particle = kept.place[at(particle)];
    }
    result.marks.push_back(std::move(one));
  }
  // A thinned body has no edges.
  std::vector<int32_t> edge_a, edge_b;
  for (int32_t i = 0; thinning.every_particle == 1 && i < body.particle_count(); ++i) {
    for (const int32_t other : body.neighbours(i)) {
      if (other <= i) continue;
      edge_a.push_back(i);
      edge_b.push_back(other);
    }
  }
  const Source* const other = plan.beside == nullptr ? nullptr : &plan.beside->source;
  result.own = drawn(plan.source, other, true, kept_together, kept, edge_a, edge_b);
  result.bytes = result.own.bytes;
  if (plan.beside != nullptr && plan.beside->is_shown) {
    result.beside = drawn(*other, &plan.source, false, kept_together, kept, {}, {});
    result.bytes += result.beside.bytes;
  }
  result.comparison = plan.comparison;
  return result;
}

json first_json(const std::optional<FirstApart>& first) {
  if (!first) return nullptr;
  return {{"frame", first->moment.is_start ? -1 : first->moment.frame},
          {"stage", name_of(first->moment.stage)},
          {"differs", first->differs},
          {"max", json_number(first->max)}};
}

Plan plan_of(const Source& source, const std::vector<Finding>& findings, const Beside* beside) {
  Plan plan = {source, beside, findings, survey_of(source), {}, {}, {}, nullptr};
  plan.marks = marks_of(source, plan.survey.moments, findings);
  for (const Finding& finding : findings) plan.named.insert(finding.frame);
  if (beside == nullptr) {
    for (const Moment& moment : plan.survey.moments) plan.moments.push_back({moment, moment.snapshot, -1});
    return plan;
  }
  plan.moments = together(plan.survey.moments, moments_of(beside->source), beside->is_shown);
  const Comparison comparison = compare(source, *beside, plan.moments);
  for (const auto* first : {&comparison.any, &comparison.decision, &comparison.greatest}) {
    if (*first) plan.named.insert((*first)->moment.frame);
  }
  plan.comparison = {{"name", beside->name},
                     {"ownName", beside->own_name},
                     {"shown", beside->is_shown},
                     {"obtained", beside->obtained},
                     {"compared", comparison.compared},
                     {"any", first_json(comparison.any)},
                     {"decision", first_json(comparison.decision)},
                     {"greatest", first_json(comparison.greatest)}};
  return plan;
}

// As many bytes as a place takes in a chunk at most, of what is not noise.
constexpr double kBytesOfPlace = 4.5;
// Moments that are drawn to see how many it takes in this run.
constexpr std::size_t kSampled = 16;

// Bytes that a place takes in this run, seen from some moments in its middle.
double sampled_bytes(const Plan& plan, double places) {
  const std::size_t count = plan.moments.size(), first = count <= kSampled ? 0 : (count - kSampled) / 2;
  const auto begin = plan.moments.begin() + static_cast<std::ptrdiff_t>(first);
  const std::vector<Together> some(begin, begin + static_cast<std::ptrdiff_t>(std::min(count, kSampled)));
  const Kept kept = kept_particles(plan.source.setup.body.particle_count(), 1, {});
  const Source* const other = plan.beside == nullptr ? nullptr : &plan.beside->source;
  const Chunks chunks = drawn(plan.source, other, true, some, kept, {}, {});
  // Of a frame as such: one in which several stages ran has several moments.
  std::set<int64_t> frames;
  for (const Together& one : some) frames.insert(one.moment.frame);
  const double found = static_cast<double>(chunks.bytes) / (static_cast<double>(frames.size()) * places);
  return std::clamp(found, 0.01, kBytesOfPlace);
}

}  // namespace

json to_json(const Marks& marks) {
  json joined = json::array();
  for (const Marks::Cluster& cluster : marks.joined)
    joined.push_back({{"number", cluster.number}, {"members", cluster.members}});
  return {{"moment", marks.moment},       {"exact", marks.is_exact}, {"partly", marks.is_partly},
          {"particles", marks.particles}, {"path", marks.path},      {"members", marks.clusters},
          {"joined", std::move(joined)},  {"corners", marks.corners}};
}

std::vector<Moment> kept_moments(const std::vector<Moment>& all, const std::set<int64_t>& named, int64_t every_frame) {
  const int64_t last = all.empty() ? 0 : all.back().frame;
  std::vector<Moment> kept;
  for (const Moment& moment : all) {
    // Where frames are left out, those that are kept are seen at their ends, unless somebody asks what a stage did.
    const bool is_named = named.count(moment.frame) != 0;
    const bool is_in_turn = moment.frame % every_frame == 0 || moment.frame == last;
    if (moment.is_start || is_named || (is_in_turn && (every_frame == 1 || moment.stage == Stage::skin)))
      kept.push_back(moment);
  }
  return kept;
}

Pictures pictures_of(const Source& source, const std::vector<Finding>& findings, int64_t most_bytes,
                     const Beside* beside) {
  const Plan plan = plan_of(source, findings, beside);
  const int64_t frames = std::max<int64_t>(1, std::ssize(plan.survey.frames));
  const auto n = static_cast<double>(source.setup.body.particle_count());
  int64_t vertices = 0;
  for (const FrameEnd& end : plan.survey.frames) vertices = std::max(vertices, end.triangles / 2);
  Thinning thinning;
  double bytes_of_place = kBytesOfPlace;
  // A guess first, so that a large run is not drawn in full only to be thrown away.
  const auto guessed = [&] {
    const auto shown = static_cast<double>((frames - 1) / thinning.every_frame + 1);
    const double runs = beside != nullptr && beside->is_shown ? 2 : 1;
    return runs * shown * bytes_of_place * (n / thinning.every_particle + static_cast<double>(vertices));
  };
  const auto thin_more = [&] {
    const bool has_frames = frames / (thinning.every_frame + 1) >= kFewestFrames;
    const bool has_particles = n / (thinning.every_particle + 1) >= 20'000;
    if (has_frames) {
      ++thinning.every_frame;
    } else if (has_particles) {
      ++thinning.every_particle;
    } else if (thinning.every_frame < frames) {
      ++thinning.every_frame;
    } else {
      return false;
    }
    return true;
  };
  if (guessed() > static_cast<double>(most_bytes) && !plan.moments.empty() && n > 0)
    bytes_of_place = sampled_bytes(plan, n + static_cast<double>(vertices));
  while (guessed() > static_cast<double>(most_bytes) && thin_more()) {
  }
  for (;;) {
    Pictures pictures = draw(plan, thinning);
    if (pictures.bytes <= most_bytes) return pictures;
    // By as much as it was too large, at once.
    const double goal = guessed() * static_cast<double>(most_bytes) / static_cast<double>(pictures.bytes);
    bool is_thinner = false;
    while (guessed() > goal * 0.98 && thin_more()) is_thinner = true;
    if (!is_thinner) return pictures;
  }
}

}  // namespace cutproof::report
