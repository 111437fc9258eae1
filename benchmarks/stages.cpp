#include "benchmarks/stages.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "benchmarks/machine_limits.h"
#include "benchmarks/paper.h"
#include "benchmarks/report.h"
#include "benchmarks/suites.h"
#include "cli/json_number.h"
#include "cli/results.h"
#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "fixtures/cook.h"
#include "harness/backends.h"
#include "model/error.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"
#if CUTPROOF_HAS_CUDA
#include "benchmarks/raw_baseline.h"
#endif

namespace cutproof::cli {

namespace {

using nlohmann::json;

std::size_t at(Stage stage) { return static_cast<std::size_t>(stage); }

constexpr Span kWholeFrame = {Stage::step, Stage::skin};

// What counts as "beyond" in Distances [h].
constexpr double kDistanceBound = 1e-4;

Vec3 kidney_size() { return {0.11, 0.06, 0.05}; }  // [m]
Vec3 box_size() { return {0.2, 0.1, 0.05}; }       // [m]

}  // namespace

// --- The scene -------------------------------------------------------------------------------------------------------

BenchScene make_bench_scene(int64_t particles, int64_t frames) {
  const bool box = particles <= kLargestBox;
  const std::string kind = box ? "box" : "kidney";
  const auto begin = Clock::now();

  Scene spec;
  spec.name = fmt::format("{}_{}", kind, particles);
  Shape shape;
  shape.kind = box ? Shape::Kind::box : Shape::Kind::kidney;
  shape.size = box ? box_size() : kidney_size();
  spec.body.shape = shape;
  spec.body.particles = particles;
  spec.step.substeps = 4;
  spec.step.iterations = 4;
  spec.step.stiffness = 1e5;
  spec.step.damping = 5;

  BenchScene scene;
  scene.name = spec.name;
  Setup& setup = scene.setup;
  setup.body = fixtures::sample(fixtures::solid_from_shape(shape, kind), spec.body, "command line");
  fixtures::take_stage_parameters(spec, setup);

  // The blade goes along x. It is well under way after a quarter of the body and has still something to cut at the end.
  const fixtures::Bounds bounds = fixtures::path_box(setup.body);
  const Vec3 extent = bounds.high - bounds.low;
  const double h = setup.body.grid.spacing;
  const double layers = extent.x / h;
  scene.advance = std::min(1.0, 0.5 * layers / static_cast<double>(frames + kJudgedFrames));
  scene.warm_up = static_cast<int64_t>(std::ceil(0.25 * layers / scene.advance));
  const int64_t all = scene.warm_up + frames + kJudgedFrames;

  // Halfway between two layers of nodes: on a layer the side of the blade would be decided by rounding.
  const double cut = std::floor(0.5 * extent.z / h) * h / extent.z;
  const double start = 1 + h / extent.x;
  BladeSpec blade;
  blade.thickness = 0.5;
  blade.speed = scene.advance * h / spec.frame_length;
  StrokeSpec stroke;
  stroke.points = {{start, 0.5, cut}, {start - scene.advance * h * static_cast<double>(all) / extent.x, 0.5, cut}};
  stroke.back = {1, 0, 0};
  stroke.along = Vec3{0, 1, 0};
  blade.strokes = {stroke};
  spec.blade = blade;
  GripSpec grip;
  grip.high = {0.1, 1, 1};
  spec.grips = {grip};
  fixtures::resolve_schedule(spec, "command line", {}, setup);

  scene.state = fixtures::cook(setup.body, spec.clusters, spec.expand, spec.merge, spec.seed);
  scene.build_seconds = seconds_since(begin);
  return scene;
}

// --- Times -----------------------------------------------------------------------------------------------------------

namespace {

// Brings the backend to where the timed frames begin.
void warm_up(Backend& backend, const BenchScene& scene) {
  backend.load({scene.setup}, {scene.state});
  for (int64_t frame = 0; frame < scene.warm_up; ++frame) backend.run(kWholeFrame);
  static_cast<void>(backend.report());  // waits
}

}  // namespace

Timings time_stages(Backend& backend, const BenchScene& scene, int64_t frames, bool pipelined, int64_t repeats) {
  Timings timings;
  std::vector<double> whole, cutting, back_to_back;
  for (int64_t repeat = 0; repeat < repeats; ++repeat) {
    warm_up(backend, scene);
    for (int64_t frame = 0; frame < frames; ++frame) {
      backend.run(kWholeFrame);
      const SpanReport report = backend.report();
      whole.push_back(report.total_seconds);
      if (report.ran[at(Stage::split)]) cutting.push_back(report.total_seconds);
    }
  }
  timings.frame = times_of(whole);
  timings.cutting = times_of(cutting);

  for (int64_t repeat = 0; pipelined && repeat < repeats; ++repeat) {
    warm_up(backend, scene);
    const auto begin = Clock::now();
    for (int64_t frame = 0; frame < frames; ++frame) backend.run(kWholeFrame);
    static_cast<void>(backend.report());
    back_to_back.push_back(seconds_since(begin) / static_cast<double>(frames));
  }
  timings.back_to_back = times_of(back_to_back);

  // Last, so that the backend is left where the timed frames end.
  std::array<std::vector<double>, 6> alone;
  for (int64_t repeat = 0; repeat < repeats; ++repeat) {
    warm_up(backend, scene);
    for (int64_t frame = 0; frame < frames; ++frame) {
      for (const Stage stage : kStages) {
        backend.run({stage, stage});
        const SpanReport report = backend.report();
        if (report.ran[at(stage)]) alone[at(stage)].push_back(report.total_seconds);
      }
    }
  }
  for (const Stage stage : kStages) timings.stage[at(stage)] = times_of(alone[at(stage)]);
  return timings;
}

// --- Errors ----------------------------------------------------------------------------------------------------------

namespace {

void run_reference(Stage stage, const Setup& setup, State& state) {
  switch (stage) {
    case Stage::step:
      return reference::step(setup, state);
    case Stage::detect:
      return reference::detect(setup, state);
    case Stage::split:
      return reference::split(setup, state);
    case Stage::merge:
      return reference::merge(setup, state);
    case Stage::expand:
      return reference::expand(setup, state);
    case Stage::skin:
      return reference::skin(setup, state);
  }
}

// Gathers distances one by one. A distance that is no number counts as infinite.
class DistanceSum {
 public:
  explicit DistanceSum(double spacing) : spacing_(spacing) {}
  void add(Vec3 a, Vec3 b) {
    double distance = norm(a - b) / spacing_;
    if (!std::isfinite(distance)) distance = std::numeric_limits<double>::infinity();
    found_.max = std::max(found_.max, distance);
    found_.beyond += distance > kDistanceBound;
    squares_ += distance * distance;
    ++count_;
  }
  Distances result() const {
    Distances distances = found_;
    if (count_ > 0) distances.rms = std::sqrt(squares_ / static_cast<double>(count_));
    return distances;
  }

 private:
  double spacing_;
  Distances found_;
  double squares_ = 0;
  int64_t count_ = 0;
};

Distances worse(const std::optional<Distances>& before, const Distances& now) {
  if (!before) return now;
  return {std::max(before->max, now.max), std::max(before->rms, now.rms), before->beyond + now.beyond};
}

Distances compare_positions(const Setup& setup, const State& expected, const State& got) {
  DistanceSum sum(setup.body.grid.spacing);
  for (std::size_t i = 0; i < got.x.size(); ++i) {
    if (got.alive[i]) sum.add(expected.x[i], got.x[i]);
  }
  return sum.result();
}

bool same_clusters(const Clusters& a, const Clusters& b) {
  return a.offsets == b.offsets && a.members == b.members && a.number == b.number;
}

// A skin without the order of its vertices and triangles: a vertex is named by 6 · owner + direction.
struct NamedSkin {
  std::vector<std::pair<int64_t, Vec3>> vertices;
  std::vector<std::array<int64_t, 3>> triangles;
};
NamedSkin named(const Skin& skin) {
  NamedSkin result;
  const auto name = [&](std::size_t v) { return 6 * int64_t{skin.owner[v]} + skin.direction[v]; };
  for (std::size_t v = 0; v < skin.owner.size(); ++v) result.vertices.emplace_back(name(v), skin.position[v]);
  for (const auto& triangle : skin.triangles) {
    std::array<int64_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = name(static_cast<std::size_t>(triangle[k]));
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.triangles.push_back(corners);
  }
  std::sort(result.vertices.begin(), result.vertices.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::sort(result.triangles.begin(), result.triangles.end());
  return result;
}

FrameErrors::Surface compare_skins(const Setup& setup, const Skin& expected, const Skin& got) {
  const NamedSkin a = named(expected), b = named(got);
  FrameErrors::Surface surface;
  surface.triangles_equal = a.triangles == b.triangles && a.vertices.size() == b.vertices.size();
  DistanceSum sum(setup.body.grid.spacing);
  for (std::size_t v = 0; v < std::min(a.vertices.size(), b.vertices.size()); ++v) {
    if (a.vertices[v].first != b.vertices[v].first) break;  // the triangles differ too
    sum.add(a.vertices[v].second, b.vertices[v].second);
  }
  surface.vertices = sum.result();
  return surface;
}

int64_t count_differing(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  std::vector<int32_t> differing;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differing));
  return static_cast<int64_t>(differing.size());
}

State take_snapshot(const Backend& backend) {
  std::vector<State> states = backend.snapshot();
  return std::move(states.front());
}

// `before` becomes the reference's answer.
void judge_stage(FrameErrors& errors, Stage stage, const Setup& setup, State& before, const State& after) {
  if (stage == Stage::detect) {
    State expected = before;
    run_reference(stage, setup, expected);
    FrameErrors::Detection found = errors.detect.value_or(FrameErrors::Detection{});
    found.removed += static_cast<int64_t>(after.removed.size());
    const int64_t differing = count_differing(expected.removed, after.removed);
    found.differing += differing;
    if (differing > 0) found.within_rounding &= oracles::detection(setup, before, after).holds;
    errors.detect = found;
    return;
  }
  run_reference(stage, setup, before);
  const State& expected = before;
  switch (stage) {
    case Stage::step:
      errors.step = worse(errors.step, compare_positions(setup, expected, after));
      break;
    case Stage::skin: {
      FrameErrors::Surface now = compare_skins(setup, expected.skin, after.skin);
      if (errors.skin) {
        now.vertices = worse(errors.skin->vertices, now.vertices);
        now.triangles_equal &= errors.skin->triangles_equal;
      }
      errors.skin = now;
      break;
    }
    default:
      errors.clusters_equal[at(stage)] =
          errors.clusters_equal[at(stage)].value_or(true) && same_clusters(expected.clusters, after.clusters);
  }
}

}  // namespace

bool FrameErrors::topology_holds() const {
  return std::all_of(topology.begin(), topology.end(), [](const Verdict& verdict) { return verdict.holds; });
}

FrameErrors judge_frames(Backend& backend, const Setup& setup) {
  FrameErrors errors;
  State state = take_snapshot(backend);
  bool cut = false;
  while (!cut && errors.frames < kJudgedFrames) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      if (!backend.report().ran[at(stage)]) continue;
      State after = take_snapshot(backend);
      judge_stage(errors, stage, setup, state, after);
      state = std::move(after);
      cut |= stage == Stage::split;
    }
    ++errors.frames;
  }
  std::vector<Verdict (*)(const Setup&, const State&)> asked = {oracles::cluster_connectivity, oracles::coverage,
                                                                oracles::edge_cover};
  if (state.edge_covered) asked.push_back(oracles::component_match);
  for (const auto oracle : asked) {
    errors.topology.push_back(oracle(setup, state));
    errors.topology.back().backend = backend.name();
  }
  errors.isolated_groups = oracles::isolation(setup, state).measured;
  return errors;
}

// --- Floors ----------------------------------------------------------------------------------------------------------

StepFloor step_floor(const Setup& setup, const State& state) {
  const auto particles = static_cast<double>(setup.body.particle_count());
  const auto memberships = static_cast<double>(state.clusters.members.size());
  const auto clusters = static_cast<double>(state.clusters.count());
  const bool contacts = setup.has_blade || !setup.walls.empty() || !setup.grips.empty();
  // match_shapes. Member: its index. Particle: displacement 16, node 4, share 4. Cluster: begin, size, body 12, rest
  // frame 24, rotation in and out 72, centre 12, flag 4.
  const double match = 4 * memberships + 24 * particles + 124 * clusters;
  // update_positions. Member: its slot. Particle: displacement in and out 32, predicted 16, node, share, first holder,
  // death 16; with contacts start 16, pushed in and out 32. Cluster: rest frame 24, rotation 36, centre 12.
  // Accelerated, the same of one iteration ago: displacement in and out 32, with contacts pushed in and out 32.
  const bool accelerated = setup.step.acceleration != Acceleration::none;
  const double earlier = accelerated ? (contacts ? 64 : 32) : 0;
  const double update = 4 * memberships + (64 + (contacts ? 48 : 0) + earlier) * particles + 72 * clusters;
  // Once a substep. Out: start 16, predicted 16; in: start 16 without contacts; with contacts impulse in and out 32.
  const double substep = (32 + (contacts ? 32 : 16)) * particles;
  // Once a frame, begin_frame and the last velocity. Displacement in and out 32, velocity in and out 32, node and death
  // 8, impulse out 16.
  const double frame = 88 * particles;
  const int64_t substeps = setup.step.substeps, iterations = setup.step.iterations;
  return {frame + static_cast<double>(substeps) * (substep + static_cast<double>(iterations) * (match + update)),
          1 + substeps * ((contacts ? 1 : 0) + 2 * iterations)};
}

namespace {

// --- Who is timed ----------------------------------------------------------------------------------------------------

std::vector<std::string> split_names(const std::string& wanted) {
  if (wanted == "blocks" || wanted == "global") return {wanted};
  if (wanted == "both") return {"blocks", "global"};
  throw InputError("command line", "--split", fmt::format("there is no split method '{}'", wanted),
                   "use blocks, global or both");
}

Contender make_contender(const BackendChoice& choice) {
  const bool kernels = choice.name != "reference";
  return {choice.name,
          kernels ? "single" : "double",
          kernels ? rotation_of(choice) : "horn",
          kernels ? choice.split : "search",
          choice.name == "gpu",
          kernels,
          make_backend(choice)};
}

}  // namespace

std::vector<Contender> make_contenders(const std::string& backend, const std::string& split,
                                       const std::string& rotation) {
  BackendChoice choice;
  choice.name = backend;
  choice.rotation = rotation;
  choice.split = split;
  require_timed_backend(choice.name);
  std::vector<Contender> contenders;
  if (choice.name == "host" || choice.name == "gpu") {
    for (const std::string& name : split_names(split.empty() ? "blocks" : split)) {
      choice.split = name;
      contenders.push_back(make_contender(choice));
    }
  } else {
    contenders.push_back(make_contender(choice));
  }
  return contenders;
}

void require_timed_sizes(const std::vector<int64_t>& sizes) {
  constexpr int64_t kLeast = 100, kMost = 1'000'000'000;
  for (const int64_t size : sizes) {
    if (size >= kLeast && size <= kMost) continue;
    throw InputError("command line", "--sizes", fmt::format("{} particles cannot be timed", size),
                     fmt::format("give numbers from {} to {}, separated by commas", kLeast, kMost));
  }
}

namespace {

// Memberships that expansion adds in the timed frames. Leaves the backend where these end.
int64_t count_added(Backend& backend, const BenchScene& scene, int64_t frames) {
  const auto memberships = [&] { return static_cast<int64_t>(take_snapshot(backend).clusters.members.size()); };
  int64_t added = 0;
  warm_up(backend, scene);
  for (int64_t frame = 0; frame < frames; ++frame) {
    backend.run({Stage::step, Stage::merge});
    const int64_t before = memberships();
    backend.run({Stage::expand, Stage::expand});
    if (backend.report().ran[at(Stage::expand)]) added += memberships() - before;
    backend.run({Stage::skin, Stage::skin});
  }
  return added;
}

}  // namespace

Measured measure(const Contender& contender, BenchScene& scene, int64_t frames, int64_t repeats) {
  Backend& backend = *contender.instance;
  Measured measured;
  measured.timings = time_stages(backend, scene, frames, contender.pipelined, repeats);
  const auto begin = Clock::now();
  if (scene.setup.body.particle_count() <= kMostJudgedParticles) {
    const bool expands = measured.timings.stage[at(Stage::expand)].count > 0;
    const int64_t added = expands ? count_added(backend, scene, frames) : 0;
    measured.judged = judge_frames(backend, scene.setup);
    measured.judged->added = added;
  }
  measured.judge_seconds = seconds_since(begin);
  return measured;
}

namespace {

// --- What is told ----------------------------------------------------------------------------------------------------

json to_json(const Distances& d) {
  return {{"max_h", json_number(d.max)}, {"rms_h", json_number(d.rms)}, {"beyond", d.beyond}};
}
std::string in_words(const Distances& d) {
  std::string text = fmt::format("{:.2g} h max, {:.2g} h RMS", d.max, d.rms);
  if (d.beyond > 0) text += fmt::format(", {} beyond {:.0e} h", d.beyond, kDistanceBound);
  return text;
}

}  // namespace

ErrorColumn error_of(Stage stage, const FrameErrors* judged) {
  if (judged == nullptr) return {"not measured", nullptr};
  switch (stage) {
    case Stage::step:
      if (judged->step) return {in_words(*judged->step), to_json(*judged->step)};
      break;
    case Stage::detect:
      if (const auto& d = judged->detect) {
        std::string text = fmt::format("{} of {} removals differ", d->differing, d->removed);
        if (d->differing > 0) text += d->within_rounding ? ", all within rounding" : ", NOT all within rounding";
        return {text, {{"removed", d->removed}, {"differing", d->differing}, {"within_rounding", d->within_rounding}}};
      }
      break;
    case Stage::skin:
      if (const auto& s = judged->skin) {
        json value = to_json(s->vertices);
        value["triangles_equal"] = s->triangles_equal;
        return {in_words(s->vertices) + (s->triangles_equal ? ", triangles equal" : ", triangles NOT equal"), value};
      }
      break;
    default:
      if (const auto equal = judged->clusters_equal[at(stage)]) {
        ErrorColumn error = {*equal ? "clusters equal" : "clusters NOT equal", {{"clusters_equal", *equal}}};
        if (stage == Stage::expand) {
          error.text += fmt::format(", {} memberships added", judged->added);
          error.value["added"] = judged->added;
        }
        return error;
      }
  }
  return {"did not run", nullptr};
}
ErrorColumn error_of_frame(const FrameErrors* judged) {
  if (judged == nullptr) return {"not measured", nullptr};
  const bool holds = judged->topology_holds();
  std::string text = holds ? "topology holds" : "topology FAILS";
  if (judged->isolated_groups > 0) text += fmt::format(", {} isolated groups", judged->isolated_groups);
  return {text, {{"topology_holds", holds}, {"isolated_groups", judged->isolated_groups}}};
}

json seconds_by_stage(const Timings& timings) {
  json seconds = {{"frame", to_json(timings.frame)}, {"frame, cutting", to_json(timings.cutting)}};
  if (timings.back_to_back.count > 0) seconds["back to back"] = to_json(timings.back_to_back);
  for (const Stage stage : kStages) seconds[std::string(name_of(stage))] = to_json(timings.stage[at(stage)]);
  return seconds;
}

json errors_by_stage(const FrameErrors* judged) {
  json errors = {{"frame", error_of_frame(judged).value}};
  for (const Stage stage : kStages) errors[std::string(name_of(stage))] = error_of(stage, judged).value;
  return errors;
}

void print_failures(const FrameErrors& judged) {
  for (const Verdict& verdict : judged.topology) {
    if (!verdict.holds) fmt::print("  FAILS: {}: {}\n", verdict.property, verdict.witness.text);
  }
}

std::string ms(const Times& times) { return times.count == 0 ? "-" : fmt::format("{:.4g}", 1e3 * times.median); }

SceneRow scene_row(const BenchScene& scene, const Contender& contender, const Measured& measured) {
  const Setup& setup = scene.setup;
  const Clusters& clusters = scene.state.clusters;
  const Times& frame = measured.timings.frame;
  SceneRow row;
  row.counts = {scene.name, fmt::format("{}", setup.body.particle_count()), fmt::format("{}", clusters.count())};
  for (const Stage stage : kStages) row.times.push_back(ms(measured.timings.stage[at(stage)]));
  row.times.push_back(ms(frame));
  row.times.push_back(fmt::format("{:.4g}", 1e3 * frame.min));
  row.times.push_back(fmt::format("{:.4g}", 1e3 * frame.max));
  row.errors = {error_of(Stage::step, measured.errors()).text, error_of_frame(measured.errors()).text};
  row.json = {{"scene", scene.name},
              {"particles", setup.body.particle_count()},
              {"clusters", clusters.count()},
              {"memberships", clusters.members.size()},
              {"spacing", setup.body.grid.spacing},
              {"backend", contender.backend},
              {"precision", contender.precision},
              {"substeps", setup.step.substeps},
              {"iterations", setup.step.iterations},
              {"rotation", contender.rotation},
              {"split", contender.split},
              {"seconds", seconds_by_stage(measured.timings)},
              {"error", errors_by_stage(measured.errors())},
              {"judged_frames", measured.judged ? measured.judged->frames : 0}};
  return row;
}

std::vector<std::string> scene_row_times() {
  std::vector<std::string> names;
  for (const Stage stage : kStages) names.emplace_back(name_of(stage));
  names.insert(names.end(), {"frame", "least", "most"});
  return names;
}

std::vector<std::string> scene_row_errors() { return {"error of step", "topology"}; }

void print_measured(const BenchScene& scene, const Contender& contender, const Measured& measured) {
  fmt::print("{}, split {}: {} particles, frame {} ms\n", scene.name, contender.split,
             scene.setup.body.particle_count(), ms(measured.timings.frame));
  if (measured.judged) print_failures(*measured.judged);
  std::fflush(stdout);
}

void declare(TimingOptions& options, CLI::App& command) {
  command.add_option("--backend", options.backend, "who is timed; `cutproof info` lists them")
      ->capture_default_str()
      ->type_name("B");
  command.add_option("--frames", options.frames, "timed frames of each repeat (default: 10; gpu: 20)")
      ->type_name("N")
      ->check(CLI::Range(1, 10'000));
  command.add_option("--repeats", options.repeats, "how often they are timed, each time after a warm-up")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 1'000));
  command.add_option("--split", options.split, "kernels: how clusters are split, blocks, global or both")
      ->type_name("M");
  command.add_option("--rotation", options.rotation, "kernels: how rotations are found")->type_name("M");
  command.add_option("--json", options.json, "write times and errors")->type_name("F");
}

namespace {

struct StagesOptions : TimingOptions {
  std::vector<int64_t> sizes;  // particles; if given, not the scenes
  std::vector<std::string> scenes = {"cuboid", "liver", "kidney", "irregular"};
  std::vector<std::string> cooking = {"boxes", "sampled"};
  bool full = false;  // the scenes at the paper's size
};

void print_row(const std::string& what, const Times& times, int64_t of, const std::string& paper,
               const std::string& error) {
  const auto one = [&](double seconds) { return times.count == 0 ? "-" : fmt::format("{:.4f}", 1e3 * seconds); };
  fmt::print("  {:<14} {:>11} {:>11} {:>11} {:>9} {:>9}  {}\n", what, one(times.median), one(times.min), one(times.max),
             fmt::format("{}/{}", times.count, of), paper, error);
}

struct Report {
  json rows = json::array(), scenes = json::array();
  bool holds = true;
};

void report_scene(Report& report, const Contender& contender, const BenchScene& scene, const Measured& measured,
                  const MachineLimits& machine, int64_t frames, int64_t repeats) {
  const Setup& setup = scene.setup;
  const Timings& timings = measured.timings;
  const FrameErrors* judged = measured.errors();
  const int64_t particles = setup.body.particle_count();
  const auto memberships = static_cast<int64_t>(scene.state.clusters.members.size());
  fmt::print(
      "\n{}: {} particles, {} clusters ({}), {} memberships, h = {:.4g} mm; the blade goes on by {:.2g} h a frame\n",
      scene.name, particles, scene.state.clusters.count(), scene.cooking, memberships, 1e3 * setup.body.grid.spacing,
      scene.advance);
  fmt::print("{}, {} precision, {} substeps × {} iterations, rotation {}, split {}\n", contender.backend,
             contender.precision, setup.step.substeps, setup.step.iterations, contender.rotation, contender.split);
  fmt::print("  {:<14} {:>11} {:>11} {:>11} {:>9} {:>9}  {}\n", "", "median ms", "least ms", "most ms", "frames",
             "paper ms", "error");

  const PaperScene* const known = find_paper_scene(scene.name);
  const PaperScene::Milliseconds* const paper = known && known->paper ? &*known->paper : nullptr;
  const auto add = [&](const std::string& what, const Times& times, std::optional<double> paper_ms,
                       const ErrorColumn& error) {
    print_row(what, times, frames * repeats, paper_ms ? fmt::format("{:.2f}", *paper_ms) : "", error.text);
    report.rows.push_back({{"scene", scene.name},
                           {"particles", particles},
                           {"cooking", scene.cooking},
                           {"backend", contender.backend},
                           {"precision", contender.precision},
                           {"substeps", setup.step.substeps},
                           {"iterations", setup.step.iterations},
                           {"rotation", contender.rotation},
                           {"split", contender.split},
                           {"what", what},
                           {"seconds", to_json(times)},
                           {"frames", times.count},
                           {"of", frames * repeats},
                           {"paper_seconds", paper_ms ? json(1e-3 * *paper_ms) : json(nullptr)},
                           {"error", error.value},
                           {"error_text", error.text}});
  };
  const ErrorColumn frame_error = error_of_frame(judged);
  add("frame", timings.frame, paper ? std::optional(paper->frame) : std::nullopt, frame_error);
  add("frame, cutting", timings.cutting, std::nullopt, frame_error);
  if (timings.back_to_back.count > 0) add("back to back", timings.back_to_back, std::nullopt, frame_error);
  for (const Stage stage : kStages) {
    add(std::string(name_of(stage)), timings.stage[at(stage)],
        paper ? std::optional(paper->stage[at(stage)]) : std::nullopt, error_of(stage, judged));
  }

  json entry = {{"scene", scene.name},
                {"cooking", scene.cooking},
                {"backend", contender.backend},
                {"rotation", contender.rotation},
                {"split", contender.split},
                {"body",
                 {{"name", setup.body.name},
                  {"particles", particles},
                  {"clusters", scene.state.clusters.count()},
                  {"memberships", memberships},
                  {"spacing", setup.body.grid.spacing},
                  {"nodes", setup.body.grid.nodes}}},
                {"stiffness", setup.step.stiffness},
                {"damping", setup.step.damping},
                {"blade_advance_h", scene.advance},
                {"warm_up", scene.warm_up},
                {"frames", frames},
                {"repeats", repeats},
                {"build_seconds", scene.build_seconds},
                {"judged_frames", judged ? judged->frames : 0},
                {"judge_seconds", measured.judge_seconds}};
  report.holds = report.holds && measured.holds();
  if (judged != nullptr) {
    entry["isolated_groups"] = judged->isolated_groups;
    entry["topology"] = json::array();
    for (const Verdict& verdict : judged->topology) entry["topology"].push_back(cli::to_json(verdict, false));
    print_failures(*judged);
  } else {
    fmt::print("  errors not measured: beyond {} particles the reference takes minutes\n", kMostJudgedParticles);
  }
  if (contender.kernel_bytes) {
    const StepFloor floor = step_floor(setup, scene.state);
    const double by_bytes = floor.bytes / machine.copy_bytes_per_second;
    const double by_launches = static_cast<double>(floor.launches) * machine.graph_node_seconds.value_or(0);
    const double step = timings.stage[at(Stage::step)].median;
    const double floor_seconds = std::max(by_bytes, by_launches);
    fmt::print("  floor of step: {:.4g} MB at the copy's bandwidth {:.4f} ms", 1e-6 * floor.bytes, 1e3 * by_bytes);
    if (machine.graph_node_seconds) fmt::print(", {} launches {:.4f} ms", floor.launches, 1e3 * by_launches);
    fmt::print("; step takes {:.2f} × its floor ({:.2f} × bytes / bandwidth)\n", step / floor_seconds, step / by_bytes);
    entry["step_floor"] = {
        {"bytes", floor.bytes},     {"launches", floor.launches},       {"bytes_seconds", by_bytes},
        {"seconds", floor_seconds}, {"multiple", step / floor_seconds}, {"multiple_of_bytes", step / by_bytes}};
    if (machine.graph_node_seconds) entry["step_floor"]["launch_seconds"] = by_launches;
  }
  report.scenes.push_back(entry);
  std::fflush(stdout);
}

// What stands in Table 1 for one scene, one way of cooking and one contender.
struct Column {
  std::string scene, cooking, split;
  int64_t particles = 0, clusters = 0;
  Timings timings;
};

// As the paper has it: a row for each stage, a column for each scene, here for each way of cooking, and the paper's
// figures beside them.
void print_table_1(const std::vector<Column>& columns) {
  std::vector<std::string> head = {"Table 1, median ms"}, cooking = {""}, particles = {"particles"},
                           clusters = {"clusters"}, frame = {"frame"};
  std::array<std::vector<std::string>, 6> stages;
  for (const Stage stage : kStages) stages[at(stage)] = {std::string(name_of(stage))};
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const Column& column = columns[k];
    head.push_back(column.scene);
    cooking.push_back(column.split == "global" ? column.cooking + ", global" : column.cooking);
    particles.push_back(fmt::format("{}", column.particles));
    clusters.push_back(fmt::format("{}", column.clusters));
    frame.push_back(ms(column.timings.frame));
    for (const Stage stage : kStages) stages[at(stage)].push_back(ms(column.timings.stage[at(stage)]));
    if (k + 1 < columns.size() && columns[k + 1].scene == column.scene) continue;
    const PaperScene& paper = *find_paper_scene(column.scene);
    if (!paper.paper) continue;
    head.push_back(column.scene);
    cooking.push_back("paper");
    particles.push_back(paper.particles ? fmt::format("{}", *paper.particles) : "?");
    clusters.push_back(paper.clusters ? fmt::format("{}", *paper.clusters) : "?");
    frame.push_back(fmt::format("{:.2f}", paper.paper->frame));
    for (const Stage stage : kStages) stages[at(stage)].push_back(fmt::format("{:.2f}", paper.paper->stage[at(stage)]));
  }
  Table table(head);
  for (const auto& row : {cooking, particles, clusters}) table.add(row);
  for (const auto& row : stages) table.add(row);
  table.add(frame);
  fmt::print("\n{}", table.text());
}

// The scenes that are asked for, made one after the other.
std::vector<std::function<BenchScene()>> scenes_of(const StagesOptions& options, int64_t frames) {
  std::vector<std::function<BenchScene()>> makers;
  require_timed_sizes(options.sizes);
  for (const int64_t size : options.sizes) makers.push_back([=] { return make_bench_scene(size, frames); });
  if (!makers.empty()) return makers;
  for (const std::string& name : options.scenes) {
    const PaperScene* const scene = find_paper_scene(name);
    if (scene == nullptr) {
      throw InputError("command line", "--scenes", fmt::format("there is no scene '{}'", name),
                       "use cuboid, liver, kidney and irregular");
    }
    for (const std::string& cooking : options.cooking) {
      const Cooking method = cooking_of(cooking);
      if (scene->sampled_only && method != Cooking::sampled) continue;
      const int64_t particles =
          options.full || options.backend == "gpu" ? scene->full_particles : scene->small_particles;
      makers.push_back([=] { return make_paper_scene(scene->file, scene->name, particles, method, frames); });
    }
  }
  return makers;
}

int bench_stages(const StagesOptions& options) {
  const int64_t frames = options.frames_or_default();
  const auto scenes = scenes_of(options, frames);
  const std::vector<Contender> contenders = make_contenders(options.backend, options.split, options.rotation);
  require_writable(options.json);

  json document = begin_report("stages", options.backend);
  document["frames"] = frames;
  document["repeats"] = options.repeats;
  const MachineLimits machine = measure_machine(options.backend);
  fmt::print("copy, read + written: {:.4g} GB/s", 1e-9 * machine.copy_bytes_per_second);
  if (machine.graph_node_seconds) {
    fmt::print("; one node of a graph {:.2f} µs (40 empty kernels {:.1f} µs)", 1e6 * *machine.graph_node_seconds,
               1e6 * *machine.chain_seconds);
  }
  fmt::print("\n");

  document["machine_limits"] = {{"copy_bytes_per_second", machine.copy_bytes_per_second}};
  if (machine.graph_node_seconds) {
    document["machine_limits"]["graph_node_seconds"] = *machine.graph_node_seconds;
    document["machine_limits"]["chain_of_40_seconds"] = *machine.chain_seconds;
  }
#if CUTPROOF_HAS_CUDA
  if (options.backend == "gpu")
    document["launch_layer"] = json::parse(gpu::raw_baseline_json(gpu::compare_with_raw(1'000'000, 200)));
#endif

  Report report;
  std::vector<Column> columns;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    BenchScene scene = scenes[k]();
    for (const Contender& contender : contenders) {
      const Measured measured = measure(contender, scene, frames, options.repeats);
      report_scene(report, contender, scene, measured, machine, frames, options.repeats);
      columns.push_back({scene.name, scene.cooking, contender.split, scene.setup.body.particle_count(),
                         scene.state.clusters.count(), measured.timings});
      // After each scene, so that what has been measured is kept if a later one fails.
      document["rows"] = report.rows;
      document["scenes"] = report.scenes;
      document["holds"] = report.holds;
      document["complete"] = k + 1 == scenes.size() && &contender == &contenders.back();
      write_report(options.json, document);
    }
  }
  if (options.sizes.empty()) print_table_1(columns);
  if (!options.json.empty()) fmt::print("\nwrote {}\n", options.json);
  return report.holds ? 0 : 1;
}

}  // namespace

Suite stages_suite() {
  return {"stages", "whole frames and each stage, a blade cutting: Table 1, or boxes and kidneys of given sizes",
          [](CLI::App& command) {
            const auto options = std::make_shared<StagesOptions>();
            declare(*options, command);
            command
                .add_option("--scenes", options->scenes,
                            "of Table 1, and the irregular path of Fig. 13, separated by commas")
                ->capture_default_str()
                ->delimiter(',')
                ->type_name("S,S...");
            command.add_option("--clusters", options->cooking, "how they are cooked, separated by commas")
                ->capture_default_str()
                ->delimiter(',')
                ->type_name("C,C...");
            command.add_flag("--full", options->full, "the scenes at the paper's size, as always on gpu");
            command
                .add_option("--sizes", options->sizes,
                            "instead of the scenes: bodies with so many particles, separated by commas")
                ->delimiter(',')
                ->type_name("N,N...");
            return [options] { return bench_stages(*options); };
          }};
}

}  // namespace cutproof::cli
