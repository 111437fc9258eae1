#include "benchmarks/stages.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
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
#include "harness/reference_stages.h"
#include "model/error.h"
#include "model/rules.h"
#include "oracles/oracles.h"
#if CUTPROOF_HAS_CUDA
#include "benchmarks/raw_baseline.h"
#endif

namespace cutproof::cli {

namespace {

using nlohmann::json;

std::size_t at(Stage stage) { return static_cast<std::size_t>(stage); }

constexpr Span kWholeFrame = {Stage::step, Stage::skin};

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

State take_snapshot(const Backend& backend) {
  std::vector<State> states = backend.snapshot();
  return std::move(states.front());
}

void note(FrameErrors& errors, const oracles::StageDifference& found, const State& after) {
  const bool equal = found.decisions.empty();
  switch (found.stage) {
    case Stage::step: {
      FrameErrors::Step step = errors.step.value_or(FrameErrors::Step{});
      step.position.join(found.error(oracles::Measure::position).norm);
      step.undecidable += found.undecidable.particles_excluded;
      errors.step = step;
      break;
    }
    case Stage::detect: {
      FrameErrors::Detection detection = errors.detect.value_or(FrameErrors::Detection{});
      detection.removed += static_cast<int64_t>(after.removed.size());
      detection.differing += static_cast<int64_t>(found.removals.size());
      detection.within_rounding &= equal && (!found.detection || found.detection->holds);
      errors.detect = detection;
      break;
    }
    case Stage::skin: {
      FrameErrors::Surface surface = errors.skin.value_or(FrameErrors::Surface{});
      surface.vertices.join(found.error(oracles::Measure::skin).norm);
      surface.triangles_equal &= equal;
      errors.skin = surface;
      break;
    }
    default:
      if (found.sets_are_open) break;
      errors.clusters_equal[at(found.stage)] = errors.clusters_equal[at(found.stage)].value_or(true) && equal;
  }
}

}  // namespace

bool FrameErrors::topology_holds() const {
  return std::all_of(topology.begin(), topology.end(), [](const Verdict& verdict) { return verdict.holds; });
}

FrameErrors judge_frames(Backend& backend, const Setup& setup) {
  FrameErrors errors;
  oracles::StageComparison comparison(setup, harness::reference_stages());
  State state = take_snapshot(backend);
  bool cut = false, readable = true;
  while (!cut && readable && errors.frames < kJudgedFrames) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      const bool ran = backend.report().ran[at(stage)];
      const bool due = is_due(setup, stage, !state.removed.empty(), state.edge_covered);
      if (!ran && !due && stage != Stage::skin) continue;  // skin counts up the frame
      State after = take_snapshot(backend);
      const oracles::StageDifference found = comparison.compare(stage, state, after, ran);
      if (ran || due) note(errors, found, after);
      state = std::move(after);
      cut |= stage == Stage::split;
      readable = found.is_readable;
      if (!readable) break;  // as the oracles below will say
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

json to_json(const oracles::ErrorNorm& norm) {
  return {{"max_h", json_number(norm.max)}, {"rms_h", json_number(norm.rms())}, {"beyond", norm.beyond}};
}
std::string in_words(const oracles::ErrorNorm& norm) {
  std::string text = fmt::format("{:.2g} h max, {:.2g} h RMS", norm.max, norm.rms());
  if (norm.beyond > 0) text += fmt::format(", {} beyond {:.0e} h", norm.beyond, oracles::kPositionsWanted);
  return text;
}

}  // namespace

ErrorColumn error_of(Stage stage, const FrameErrors* judged) {
  if (judged == nullptr) return {"not measured", nullptr};
  switch (stage) {
    case Stage::step:
      if (const auto& s = judged->step) {
        ErrorColumn error = {in_words(s->position), to_json(s->position)};
        error.value["undecidable"] = s->undecidable;
        if (s->undecidable > 0) error.text += fmt::format(", {} undecidable within rounding", s->undecidable);
        return error;
      }
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
