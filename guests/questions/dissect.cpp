// Whole simulators: random bodies and what blades do to them, judged as runs (oracles.md, A run of any simulator).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <utility>

#include "guests/questions/kinds.h"
#include "guests/questions/scenes.h"
#include "guests/tissue_arrays.h"
#include "harness/foreign_run.h"
#include "model/at.h"
#include "model/error.h"
#include "oracles/runs/run.h"

namespace cutproof::guests {

namespace {

using namespace scenes;

constexpr const char* kDissectSource = "docs/reference/plugins.md, Whole simulators";

constexpr const char* kAsAsked = "run as asked";
constexpr const char* kAsDrawn = "cut as drawn";

// Verdict on numbers of which the greatest is kept.
class Greatest {
 public:
  Greatest(const char* property, const char* unit, double bound) {
    verdict_.property = property;
    verdict_.unit = unit;
    verdict_.bound = bound;
    verdict_.bound_source = kDissectSource;
  }
  void see(double measured, int64_t particle, int64_t frame, const char* text) {
    ++verdict_.checked;
    // NaN is the worst value.
    if (!std::isnan(verdict_.measured) && !(measured <= verdict_.measured)) verdict_.measured = measured;
    if (measured <= verdict_.bound || !verdict_.holds) return;
    verdict_.holds = false;
    verdict_.frame = frame;
    verdict_.witness.particles = {static_cast<int32_t>(particle)};
    verdict_.witness.text =
        fmt::format("particle {} {} by {:.3g} {} in frame {}", particle, text, measured, verdict_.unit, frame);
  }
  const Verdict& verdict() const { return verdict_; }

 private:
  Verdict verdict_;
};

// It begins where it was told to, and what is held stays while it exists. `run`: of run_files().
std::vector<Verdict> judge_as_asked(const Scene& scene, const std::vector<io::ArrayFile>& run, double u) {
  const auto of = [&](std::size_t frame, const char* name) {
    const Array* const array = find_array(run[frame].arrays, name);
    return array != nullptr ? vectors_of(*array) : std::vector<Vec3>{};
  };
  double farthest = 0, fastest = 0;
  for (const Vec3 x : scene.rest) farthest = std::max(farthest, norm(x));
  for (const Vec3 v : scene.velocity) fastest = std::max(fastest, norm(v));
  const std::vector<Vec3> start = of(0, "positions"), velocity = of(0, "velocities");
  // Two roundings each; velocities of a staggered scheme are up to a frame of gravity away.
  Greatest places(kAsAsked, "m", 4 * u * farthest);
  Greatest velocities("velocities as asked", "m/s", 4 * u * fastest + scene.frame_time * norm(scene.gravity));
  Greatest held("what is held stays", "m", 4 * u * farthest);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) {
    const auto particle = static_cast<int64_t>(i);
    places.see(norm(start[i] - scene.rest[i]), particle, 0, "does not start at rest, but beside it");
    if (!velocity.empty()) {
      velocities.see(scene.held[i] != 0 ? 0 : norm(velocity[i] - scene.velocity[i]), particle, 0,
                     "starts with another velocity");
    }
  }
  for (std::size_t f = 0; f < run.size(); ++f) {
    const std::vector<Vec3> now = of(f, "positions");
    const Array* const alive = find_array(run[f].arrays, "alive");
    for (std::size_t i = 0; i < std::min(now.size(), scene.held.size()); ++i) {
      const bool is_gone =
          oracles::is_blank(now[i]) || (alive != nullptr && alive->integer(static_cast<int64_t>(i)) == 0);
      if (scene.held[i] == 0 || is_gone) continue;
      held.see(norm(now[i] - start[i]), static_cast<int64_t>(i), static_cast<int64_t>(f), "is held, and has moved");
    }
  }
  return {places.verdict(), velocities.verdict(), held.verdict()};
}

// One case.
std::vector<Verdict> judge_scene(const Question& question, const Arrays& answers, Precision precision) {
  RunFiles run = run_files(question, answers, precision);
  if (!run.problem.empty()) return {unreadable(kAsAsked, run.problem)};
  std::vector<Verdict> verdicts = judge_as_asked(scene_of(question.given), run.frames, unit_roundoff(precision));
  harness::JudgedRun judged;
  try {
    io::RunSegments segments("the run", std::move(run.frames));
    judged = harness::judge_run(std::move(segments));
  } catch (const InputError& error) {
    return {unreadable(kAsAsked, error.what())};
  }
  for (Verdict& verdict : judged.verdicts) {
    // Whether it was is said of the kind.
    if (verdict.property != "something was cut") verdicts.push_back(std::move(verdict));
  }
  for (const harness::NotJudged& each : judged.not_judged) {
    if (each.property == "determinism" || each.property == "something was cut") continue;
    Verdict& verdict = verdicts.emplace_back();
    verdict.property = each.property;
    verdict.vacuous = each.why;
  }
  Verdict& as_drawn = verdicts.emplace_back();
  as_drawn.property = kAsDrawn;
  as_drawn.bound_source = kDissectSource;
  as_drawn.checked = judged.pieces.units > 0 && is_as_drawn(question.kind, judged.pieces) ? 1 : 0;
  if (as_drawn.checked == 0) as_drawn.vacuous = "the tissue was not cut as the kind says";
  return verdicts;
}

std::string difference_of_runs(const Question& question, const Arrays& one, const Arrays& other) {
  if (!run_files(question, one, Precision::binary64).problem.empty()) return "";  // a verdict by itself
  const Array &a = *find_array(one, "run/position"), &b = *find_array(other, "run/position");
  const Array& particles = *find_array(one, "run/particles");
  const Scene scene = scene_of(question.given);
  const int64_t row = 3 * size_of(a.type);
  for (int64_t f = 0, first = 0; f < scene.frames; ++f) {
    const int64_t count = f < particles.rows() ? particles.integer(f) : scene.count();
    for (int64_t i = first; i < std::min({first + count, a.rows(), b.rows()}); ++i) {
      if (std::memcmp(a.bytes.data() + i * row, b.bytes.data() + i * row, at(row)) == 0) continue;
      const auto place = [&](const Array& of) {
        return Vec3{of.number(3 * i), of.number(3 * i + 1), of.number(3 * i + 2)};
      };
      return fmt::format("run again, particle {} is {:.3g} m beside where it was in frame {}", i - first,
                         norm(place(a) - place(b)), f);
    }
    first += count;
  }
  for (const Array& array : one) {
    if (array.name != "run/seconds" && !(*find_array(other, array.name) == array))
      return fmt::format("run again, '{}' is not the same", array.name);
  }
  return "";
}

Scene part_of(const Scene& scene, std::vector<uint8_t> keep) {
  // Where all particles are corners of cells they stay so.
  const auto cells_left = [&](const std::vector<int32_t>& cells, std::size_t corners, const auto& visit) {
    for (std::size_t k = 0; k + corners <= cells.size(); k += corners) {
      const auto cell = std::span(cells).subspan(k, corners);
      if (std::all_of(cell.begin(), cell.end(), [&](int32_t i) { return keep[at(i)] != 0; })) visit(cell);
    }
  };
  std::vector<uint8_t> is_corner(keep.size(), 0), was_corner(keep.size(), 0);
  for (const int32_t i : scene.tetrahedra) was_corner[at(i)] = 1;
  if (std::find(was_corner.begin(), was_corner.end(), 0) == was_corner.end()) {
    cells_left(scene.tetrahedra, 4, [&](std::span<const int32_t> cell) {
      for (const int32_t i : cell) is_corner[at(i)] = 1;
    });
    keep = is_corner;
  }
  Scene part = scene;
  std::vector<int32_t> number(keep.size(), -1);
  part.rest.clear(), part.velocity.clear(), part.kick.clear(), part.mass.clear(), part.held.clear(), part.node.clear();
  part.edges.clear(), part.tetrahedra.clear(), part.hexahedra.clear();
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    number[i] = static_cast<int32_t>(part.count());
    part.rest.push_back(scene.rest[i]);
    part.velocity.push_back(scene.velocity[i]);
    part.kick.push_back(scene.kick[i]);
    part.mass.push_back(scene.mass[i]);
    part.held.push_back(scene.held[i]);
    part.node.insert(part.node.end(), &scene.node[3 * i], &scene.node[3 * i] + 3);
  }
  for (const auto& [a, b] : scene.edges) {
    if (keep[at(a)] != 0 && keep[at(b)] != 0) part.edges.push_back({number[at(a)], number[at(b)]});
  }
  cells_left(scene.tetrahedra, 4, [&](std::span<const int32_t> cell) {
    for (const int32_t i : cell) part.tetrahedra.push_back(number[at(i)]);
  });
  cells_left(scene.hexahedra, 8, [&](std::span<const int32_t> cell) {
    for (const int32_t i : cell) part.hexahedra.push_back(number[at(i)]);
  });
  return part;
}

std::vector<Question> simpler_scenes(const Question& question) {
  const Scene scene = scene_of(question.given);
  std::vector<Question> simpler;
  const auto add = [&](const Scene& other) {
    if (is_joined_by_faces(scene.tetrahedra) && !is_joined_by_faces(other.tetrahedra)) return;
    Question next = question;
    next.given = arrays_of(other);
    if (other.count() > 0 && !(next == question) && (simpler.empty() || !(next == simpler.back())))
      simpler.push_back(std::move(next));
  };
  // Without a stroke.
  for (int64_t gone = 0; gone < scene.blades && scene.blades > 1; ++gone) {
    Scene other = scene;
    other.blades -= 1;
    other.blade.clear();
    for (int64_t k = 0; k < scene.frames * scene.blades; ++k) {
      if (k % scene.blades != gone)
        other.blade.insert(other.blade.end(), &scene.blade[at(4 * k)], &scene.blade[at(4 * k)] + 4);
    }
    add(other);
  }
  // Without a half along an axis, the layer at an end of it, one particle.
  const auto keep_where = [&](const std::function<bool(std::size_t)>& is_kept) {
    std::vector<uint8_t> keep(scene.rest.size());
    for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = is_kept(i);
    add(part_of(scene, keep));
  };
  for (const bool is_half : {true, false}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Range range = range_along(scene, axis_vector(axis));
      if (range.high - range.low < 0.5) continue;
      const double middle = 0.5 * (range.low + range.high);
      const auto place = [&](std::size_t i) { return scene.rest[i][axis] / scene.h; };
      keep_where([&](std::size_t i) { return place(i) > (is_half ? middle : range.low + 0.5); });
      keep_where([&](std::size_t i) { return place(i) < (is_half ? middle : range.high - 0.5); });
    }
  }
  for (std::size_t gone = 0; gone < scene.rest.size(); ++gone) {
    keep_where([&](std::size_t i) { return i != gone; });
  }
  // Fewer frames, and less motion.
  for (const int64_t frames : {scene.frames / 2, scene.frames - 1}) {
    Scene other = scene;
    other.frames = std::max<int64_t>(frames, 2);
    other.blade.resize(at(other.frames * other.blades * 4));
    if (other.frames < scene.frames) add(other);
  }
  Scene other = scene;
  std::fill(other.velocity.begin(), other.velocity.end(), Vec3{});
  add(other);
  other = scene;
  other.gravity = {};
  add(other);
  other = scene;
  std::fill(other.held.begin(), other.held.end(), 0);
  add(other);
  return simpler;
}

}  // namespace

const OperationDescription kDissect = {
    .number = wire::dissect,
    .name = "dissect",
    .text = "a whole simulator: the run of a body that is cut",
    .by_itself = "",
    .answers = kRunAnswers,
    .cases = "scenes",
    .draw = draw_scene,
    .cases_of = one_body,
    .size_of = size_of_scene,
    .judge = judge_scene,
    .problem = problem_of_scene,
    .simpler = simpler_scenes,
    .kinds = scene_kinds,
    .draw_for = draw_scene_for,
    .as_drawn = kAsDrawn,
    .difference = difference_of_runs,
    .judge_beside = judge_runs_beside,
    .files = files_of,
};

}  // namespace cutproof::guests
