#include "benchmarks/methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "benchmarks/paper.h"
#include "benchmarks/report.h"
#include "benchmarks/timing.h"
#include "fixtures/build.h"
#include "guests/questions/campaign.h"
#include "harness/foreign_run.h"
#include "model/at.h"
#include "model/error.h"
#include "model/io/state_segments.h"
#include "model/precision.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

namespace scenes = guests::scenes;

namespace {

constexpr double kRest = 0.48;        // [s] until the blade comes
constexpr double kDamping = 20;       // [1/s] so that it is at rest by then
constexpr double kAfterwards = 0.16;  // [s]
constexpr double kKick = 0.1;         // [m/s]
constexpr int64_t kFeltFrames = 5;    // in which a kick is looked for
constexpr int64_t kFragment = 8;      // pieces of fewer units are fragments
constexpr double kTimeLimit = 1800;   // [s] of a plugin for one run

// What the blade's edge sweeps on the way to each frame of a run, and on the way to the one before: tissue that moves
// meanwhile is not left uncut between two patches. NaN: nothing.
std::vector<Vec3> swept_by_edge(const Setup& setup) {
  const double nan = std::nan("");
  std::vector<Vec3> corners(4, Vec3{nan, nan, nan});
  const int64_t substeps = setup.step.substeps;
  const BladePose* before = nullptr;  // where the edge was as the frame before began, in the same stroke
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    const BladeMove *first = nullptr, *last = nullptr;
    for (int64_t s = frame * substeps; s < (frame + 1) * substeps; ++s) {
      const BladeMove& move = setup.blade_moves[at(s)];
      if (!move.down) continue;
      if (first == nullptr) first = &move;
      last = &move;
    }
    const auto end = [&](const BladePose& pose, double side) {
      return pose.edge + (side * setup.blade.length / 2) * pose.along;
    };
    if (first == nullptr) {
      corners.insert(corners.end(), 4, Vec3{nan, nan, nan});
      before = nullptr;
      continue;
    }
    const BladePose& from = before != nullptr ? *before : first->from;
    corners.insert(corners.end(), {end(from, -1), end(from, 1), end(last->to, 1), end(last->to, -1)});
    before = &first->from;
  }
  return corners;
}

bool is_swept(const std::vector<Vec3>& corners, int64_t frame) { return std::isfinite(corners[at(4 * frame)].x); }

scenes::Scene scene_of(const Setup& setup, const State& start) {
  const Body& body = setup.body;
  scenes::Scene scene;
  scene.h = body.grid.spacing;
  scene.nodes.assign(body.grid.nodes.begin(), body.grid.nodes.end());
  scene.mass = body.mass;
  scene.velocity = start.v;
  scene.held.assign(at(body.particle_count()), 0);
  scene.kick.assign(at(body.particle_count()), Vec3{});
  for (const Grip& grip : setup.grips) {
    for (const int32_t i : grip.particles) scene.held[at(i)] = 1;
  }
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    scene.rest.push_back(body.rest_position(i));
    const auto node = body.grid.coordinates(body.node[at(i)]);
    scene.node.insert(scene.node.end(), node.begin(), node.end());
    for (const int32_t other : body.neighbours(i)) {
      if (other > i) scene.edges.push_back({i, other});
    }
  }
  std::sort(scene.edges.begin(), scene.edges.end());
  scenes::add_cells(scene);
  scene.gravity = setup.step.gravity;
  scene.frame_time = setup.substep_length.front() * setup.step.substeps;
  scene.frames = setup.frame_count() + 1;
  scene.blades = 1;
  return scene;
}

// Without particles that are corners of no cell: elements know nothing of them.
Body corners_of_cells(Body body) {
  const Grid& grid = body.grid;
  const std::size_t n = body.node.size();
  std::vector<uint8_t> is_corner(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<int32_t, 8> corners;
    for (int64_t k = 0; k < 8; ++k) {
      const int64_t node =
          body.node[i] + (k & 1) + (k >> 1 & 1) * grid.nodes[0] + (k >> 2) * int64_t{grid.nodes[0]} * grid.nodes[1];
      corners[at(k)] = body.particle_at[at(node)];
    }
    if (std::find(corners.begin(), corners.end(), -1) != corners.end()) continue;
    for (const int32_t corner : corners) is_corner[at(corner)] = 1;
  }
  Body kept = body;
  kept.node.clear(), kept.mass.clear(), kept.surface_crossing.clear();
  std::fill(kept.particle_at.begin(), kept.particle_at.end(), -1);
  for (std::size_t i = 0; i < n; ++i) {
    if (is_corner[i] == 0) continue;
    kept.particle_at[at(body.node[i])] = static_cast<int32_t>(kept.node.size());
    kept.node.push_back(body.node[i]);
    kept.mass.push_back(body.mass[i]);
    if (body.surface_crossing.empty()) continue;
    const auto first = body.surface_crossing.begin() + static_cast<std::ptrdiff_t>(6 * i);
    kept.surface_crossing.insert(kept.surface_crossing.end(), first, first + 6);
  }
  return kept;
}

// E = ½ ρ k c h² for cores of c nodes a side.
void take_modulus(const Scene& spec, double youngs_modulus, Kidney& kidney) {
  const double h = kidney.setup.body.grid.spacing, c = spec.clusters.side;
  kidney.youngs_modulus = youngs_modulus;
  kidney.setup.step.stiffness = 2 * youngs_modulus / (spec.body.density * c * h * h);
}

// A block that spins: 12 × 6 × 6 particles, 60 frames without gravity.
Kidney make_spinning_block() {
  Scene spec = embedded_scene("kidney_101096");
  spec.name = "spinning block";
  spec.body = {};
  spec.body.shape.emplace();
  spec.body.shape->size = {0.0235, 0.0115, 0.0115};
  spec.body.spacing = 0.002;
  spec.grips.clear();
  spec.blade.reset();
  spec.frames = 60;
  spec.settle = 0;
  spec.expect = {};
  spec.step.gravity = {};
  spec.step.damping = 0;
  spec.detect.criterion = Criterion::none;
  fixtures::Built built = fixtures::build(spec, "command line");
  Kidney block;
  block.setup = std::move(built.setup);
  block.start = std::move(built.state);
  take_modulus(spec, 1e4, block);
  Vec3 centre;
  for (const Vec3 x : block.start.x) centre += x / static_cast<double>(block.start.x.size());
  for (std::size_t i = 0; i < block.start.x.size(); ++i)
    block.start.v[i] = cross(Vec3{3, 5, 8}, block.start.x[i] - centre);
  block.scene = scene_of(block.setup, block.start);
  block.scene.blade.assign(at(4 * block.scene.frames), Vec3{std::nan(""), std::nan(""), std::nan("")});
  return block;
}
// About the centre of mass, of what exists.
Vec3 angular_momentum(const io::ArrayFile& frame, const std::vector<double>& mass_given) {
  const auto of = [&](const char* name) { return find_array(frame.arrays, name); };
  const std::vector<Vec3> x = scenes::vectors_of(*of("positions")), v = scenes::vectors_of(*of("velocities"));
  const Array *const own = of("mass"), *const alive = of("alive"), *const spin = of("spin");
  double total = 0;
  Vec3 centre, sum;
  const auto mass = [&](std::size_t i) {
    if (alive != nullptr && alive->integer(static_cast<int64_t>(i)) == 0) return 0.0;
    return own != nullptr ? own->number(static_cast<int64_t>(i)) : mass_given[i];
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    total += mass(i);
    centre += x[i] * mass(i);
  }
  centre = centre / total;
  for (std::size_t i = 0; i < x.size(); ++i) sum += cross(x[i] - centre, v[i]) * mass(i);
  if (spin != nullptr) {
    for (const Vec3 s : scenes::vectors_of(*spin)) sum += s;
  }
  return sum;
}

// Of a free block that spins without gravity: its angular momentum at the end, as a share of that at the start. Nothing
// where the method refuses it or tells no velocities.
std::optional<double> spin_kept(Method& method) {
  const Kidney block = make_spinning_block();
  const MethodRun run = method.run(block, block.scene.frames, nullptr);
  if (!run.refused.empty() || find_array(run.frames.back().arrays, "velocities") == nullptr) return std::nullopt;
  const Vec3 first = angular_momentum(run.frames.front(), block.scene.mass),
             last = angular_momentum(run.frames.back(), block.scene.mass);
  return dot(last, first) / dot(first, first);
}

// --- This method -----------------------------------------------------------------------------------------------------

class OwnMethod : public Method {
 public:
  OwnMethod(std::string backend, Baseline baseline, int32_t iterations)
      : backend_(std::move(backend)), baseline_(std::move(baseline)), iterations_(iterations) {}

  std::string name() const override { return baseline_.name; }
  std::string source() const override { return baseline_.source; }
  std::string settings() const override {
    return fmt::format("iterations={},remove={}", iterations_, name_of(baseline_.remove));
  }

  MethodRun run(const Kidney& kidney, int64_t frames, const MethodKick* kick) override {
    Setup setup = kidney.setup;
    setup.step.iterations = iterations_;
    if (setup.detect.criterion == Criterion::distance) setup.detect.remove = baseline_.remove;
    const std::unique_ptr<Backend> backend = make_timed_backend(backend_);
    MethodRun run;
    io::StateSegments segments(setup, kidney.start.precision, io::StateSegments::WithSkin::no);
    // What is removed lies within a spacing of the sweep.
    const auto keep = [&](const State& state, std::size_t frame) {
      io::ArrayFile& file = run.frames.emplace_back(segments.next(state));
      const auto quad = std::span(kidney.scene.blade).subspan(4 * frame, 4);
      if (std::isfinite(quad.front().x))
        file.arrays.push_back(make_array("blade", {1, 1, 4, 3}, scenes::numbers_of({quad.begin(), quad.end()})));
      if (frame == 0) {
        file.arrays.push_back(make_array("cut_resolution", {1}, std::vector<double>{kidney.setup.body.grid.spacing}));
      }
    };
    backend->load({setup}, {kidney.start});
    State state = std::move(backend->snapshot().front());
    keep(state, 0);
    for (int64_t frame = 1; frame < frames; ++frame) {
      if (kick != nullptr && kick->frame == frame) {
        for (const int32_t i : kick->particles) state.v[at(i)] += kick->velocity;
        backend->load({setup}, {state});
      }
      run.seconds.push_back(run_frame(*backend, baseline_, setup));
      state = std::move(backend->snapshot().front());
      keep(state, at(frame));
    }
    return run;
  }

 private:
  std::string backend_;
  Baseline baseline_;
  int32_t iterations_;
};

// --- Plugins ---------------------------------------------------------------------------------------------------------

class PluginMethod : public Method {
 public:
  explicit PluginMethod(const std::string& plugin) {
    const std::size_t comma = plugin.find(',');
    file_ = plugin.substr(0, comma);
    parameters_ = comma == std::string::npos ? "" : plugin.substr(comma + 1);
    const guests::Guest guest({.library = file_, .parameters = parameters_});
    if (!guest.plugin().offers(guests::wire::dissect)) {
      throw InputError(file_, "plugin", "it has no operation 'dissect'",
                       "give a plugin that is a whole simulator (docs/reference/plugins.md)");
    }
    name_ = guest.plugin().name;
    version_ = guest.plugin().version;
  }
  std::string name() const override { return name_; }
  std::string source() const override { return version_; }
  std::string settings() const override { return parameters_; }

  MethodRun run(const Kidney& kidney, int64_t frames, const MethodKick* kick) override {
    scenes::Scene scene = kidney.scene;
    scene.frames = frames;
    scene.blade.resize(at(4 * frames));
    if (kick != nullptr) {
      scene.kick_frame = kick->frame;
      for (const int32_t i : kick->particles) scene.kick[at(i)] = kick->velocity;
    }
    const double volume = scene.h * scene.h * scene.h;
    guests::Guest guest(
        {.library = file_,
         .parameters = fmt::format("youngs_modulus={},poisson_ratio=0,density={},damping={}{}{}", kidney.youngs_modulus,
                                   scene.mass.front() / volume, kidney.setup.step.damping,
                                   parameters_.empty() ? "" : ",", parameters_),
         .time_limit = kTimeLimit});
    const guests::Question question = scenes::question_of(scene, "", guest.plugin());
    const auto begin = Clock::now();
    const guests::Answer answer = ask(guest, *guests::find_operation("dissect"), question, true);
    const double whole = seconds_since(begin);
    MethodRun run;
    if (answer.kind != guests::Answer::Kind::answered) {
      run.refused = answer.text.empty() ? "it refuses the scene" : answer.text;
      return run;
    }
    scenes::RunFiles files = scenes::run_files(question, answer.arrays, guest.plugin().precision);
    run.refused = files.problem;
    run.frames = std::move(files.frames);
    const Array* const seconds = find_array(answer.arrays, "run/seconds");
    run.timed_by_judge = seconds->rows() == 0;
    for (int64_t f = 1; f < frames; ++f) {
      run.seconds.push_back(run.timed_by_judge ? whole / static_cast<double>(frames - 1) : seconds->number(f));
    }
    return run;
  }

 private:
  std::string file_, parameters_, name_, version_;
};

// --- Figures ---------------------------------------------------------------------------------------------------------

double mass_of(const io::ArrayFile& frame, const std::vector<double>& given) {
  const Array *const own = find_array(frame.arrays, "mass"), *const alive = find_array(frame.arrays, "alive");
  const int64_t count = find_array(frame.arrays, "positions")->count() / 3;
  double sum = 0;
  for (int64_t i = 0; i < count; ++i) {
    if (alive != nullptr && alive->integer(i) == 0) continue;
    sum += own != nullptr ? own->number(i) : i < std::ssize(given) ? given[at(i)] : 0;
  }
  return sum;
}

// Greatest and RMS distance from the converged solution, as shares of its RMS displacement.
nlohmann::json error_of(const MethodRun& run, const Kidney& kidney, const ConvergedKidney& truth) {
  const std::vector<Vec3> x = scenes::vectors_of(*find_array(run.frames[at(kidney.uncut)].arrays, "positions"));
  const Body& body = kidney.setup.body;
  double squares = 0, of_truth = 0, greatest = 0;
  int64_t count = 0;
  for (std::size_t i = 0; i < kidney.scene.rest.size(); ++i) {
    const Vec3 rest = kidney.scene.rest[i];
    const std::optional<Vec3> right = truth.at_rest_place(body.orientation * rest + body.origin);
    if (!right) continue;
    const Vec3 off = body.orientation * (x[i] - rest) - *right;
    squares += dot(off, off);
    of_truth += dot(*right, *right);
    greatest = std::max(greatest, norm(off));
    ++count;
  }
  const double scale = std::sqrt(of_truth / static_cast<double>(std::max<int64_t>(count, 1)));
  return {{"rms", std::sqrt(squares / of_truth)},
          {"greatest", greatest / scale},
          {"particles", count},
          {"displacement", scale}};
}

// The largest piece that nothing holds is kicked. How far what is held is off, as a share of how far that piece is;
// null where no piece is free. `piece`: of each particle of the scene.
nlohmann::json felt(Method& method, const Kidney& kidney, const MethodRun& without, const std::vector<int32_t>& piece,
                    int64_t kick_frame) {
  std::map<int32_t, std::vector<int32_t>> free;
  for (int32_t i = 0; i < kidney.scene.count(); ++i) {
    if (piece[at(i)] >= 0) free[piece[at(i)]].push_back(i);
  }
  std::set<int32_t> held;
  for (int32_t i = 0; i < kidney.scene.count(); ++i) {
    if (kidney.scene.held[at(i)] != 0) held.insert(piece[at(i)]);
  }
  std::erase_if(free, [&](const auto& one) { return held.contains(one.first); });
  const auto largest = std::max_element(free.begin(), free.end(),
                                        [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  if (largest == free.end() || std::ssize(largest->second) < kFragment) return nullptr;
  const MethodKick kick = {kick_frame, largest->second, {kKick, 0, kKick}};
  const int64_t frames = std::min(kick_frame + kFeltFrames, kidney.scene.frames);
  const MethodRun with = method.run(kidney, frames, &kick);
  if (!with.refused.empty()) return nullptr;
  double own = 0, others = 0;
  for (int64_t f = kick_frame; f < frames; ++f) {
    const std::vector<Vec3> a = scenes::vectors_of(*find_array(without.frames[at(f)].arrays, "positions")),
                            b = scenes::vectors_of(*find_array(with.frames[at(f)].arrays, "positions"));
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const double off = norm(b[i] - a[i]);
      if (!std::isfinite(off)) continue;
      if (piece[i] == largest->first) own = std::max(own, off);
      if (held.contains(piece[i])) others = std::max(others, off);
    }
  }
  return own > 0 ? nlohmann::json(others / own) : nlohmann::json();
}

}  // namespace

Kidney make_kidney(int64_t particles, double youngs_modulus) {
  Scene spec = embedded_scene("kidney_101096");
  spec.grips.resize(1);
  // The left end, from which the rest hangs.
  spec.grips.front().low = {0, 0, 0};
  spec.grips.front().high = {0.4, 1, 1};
  spec.settle = kAfterwards;
  spec.blade->start = kRest;
  spec.expect = {};
  spec.step.gravity = {0, 0, -9.81};
  spec.step.damping = kDamping;
  spec.step.acceleration = Acceleration::chebyshev;
  spec.body.particles = particles;
  fixtures::Built built = fixtures::build_on(corners_of_cells(fixtures::body_of_shape(spec, "command line")), spec,
                                             "command line", std::nullopt);
  Kidney kidney;
  kidney.setup = std::move(built.setup);
  kidney.start = std::move(built.state);
  take_modulus(spec, youngs_modulus, kidney);
  kidney.scene = scene_of(kidney.setup, kidney.start);
  kidney.scene.blade = swept_by_edge(kidney.setup);
  for (int64_t f = 0; f < kidney.scene.frames; ++f) {
    if (!is_swept(kidney.scene.blade, f)) continue;
    if (kidney.uncut == 0) kidney.uncut = f - 1;
    kidney.last_cut = f;
  }
  return kidney;
}

std::unique_ptr<Method> make_own_method(const std::string& backend, const Baseline& baseline, int32_t iterations) {
  return std::make_unique<OwnMethod>(backend, baseline, iterations);
}
std::unique_ptr<Method> make_plugin_method(const std::string& plugin) { return std::make_unique<PluginMethod>(plugin); }

ConvergedKidney::ConvergedKidney(Method& method, int64_t particles, double youngs_modulus)
    : kidney_(make_kidney(particles, youngs_modulus)) {
  const MethodRun run = method.run(kidney_, kidney_.uncut + 1, nullptr);
  if (!run.refused.empty())
    throw InputError("command line", "--truth", run.refused, "give a plugin that simulates the finer kidney");
  const std::vector<Vec3> x = scenes::vectors_of(*find_array(run.frames.back().arrays, "positions"));
  for (std::size_t i = 0; i < kidney_.scene.rest.size(); ++i)
    displacement_.push_back(kidney_.setup.body.orientation * (x[i] - kidney_.scene.rest[i]));
}

std::optional<Vec3> ConvergedKidney::at_rest_place(Vec3 place) const {
  const Body& body = kidney_.setup.body;
  const Vec3 local = transposed(body.orientation) * (place - body.origin) / body.grid.spacing;
  const int32_t low[3] = {static_cast<int32_t>(std::floor(local.x)), static_cast<int32_t>(std::floor(local.y)),
                          static_cast<int32_t>(std::floor(local.z))};
  Vec3 sum;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    int64_t node = 0, step = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t up = corner >> axis & 1, coordinate = low[axis] + up;
      if (coordinate < 0 || coordinate >= body.grid.nodes[at(axis)]) return std::nullopt;
      const double share = local[axis] - low[axis];
      weight *= up != 0 ? share : 1 - share;
      node += coordinate * step;
      step *= body.grid.nodes[at(axis)];
    }
    const int32_t particle = body.particle_at[at(node)];
    if (particle < 0) return std::nullopt;
    sum += displacement_[at(particle)] * weight;
  }
  return sum;
}

nlohmann::json row_of(Method& method, const Kidney& kidney, const ConvergedKidney* truth, bool with_kicks,
                      const std::string& folder) {
  nlohmann::json row = {{"name", method.name()},
                        {"source", method.source()},
                        {"settings", method.settings()},
                        {"particles", kidney.scene.count()},
                        {"refused", nullptr},
                        {"timed_by_judge", false},
                        {"fails", nlohmann::json::array()},
                        {"felt", {{"blade_in", nullptr}, {"withdrawn", nullptr}}}};
  for (const char* const figure :
       {"seconds_per_second", "by_frame", "frame", "cutting", "error", "lost", "pieces", "fragments", "spin_kept"})
    row[figure] = nullptr;
  MethodRun run = method.run(kidney, kidney.scene.frames, nullptr);
  if (!run.refused.empty()) {
    row["refused"] = run.refused;
    return row;
  }
  if (!folder.empty()) {
    std::filesystem::create_directories(folder);
    for (std::size_t f = 0; f < run.frames.size(); ++f)
      io::write_array_file(fmt::format("{}/{:06}.npz", folder, f), run.frames[f]);
  }
  const double frame_time = kidney.scene.frame_time;
  double sum = 0;
  std::vector<double> cutting;
  for (std::size_t f = 0; f < run.seconds.size(); ++f) {
    sum += run.seconds[f];
    if (is_swept(kidney.scene.blade, static_cast<int64_t>(f) + 1)) cutting.push_back(run.seconds[f]);
  }
  row["seconds_per_second"] = sum / (frame_time * static_cast<double>(run.seconds.size()));
  row["by_frame"] = run.seconds;
  row["frame"] = to_json(times_of(run.seconds));
  row["cutting"] = to_json(times_of(std::move(cutting)));
  row["timed_by_judge"] = run.timed_by_judge;
  if (truth != nullptr) row["error"] = error_of(run, kidney, *truth);
  row["lost"] = 1 - mass_of(run.frames.back(), kidney.scene.mass) / mass_of(run.frames.front(), kidney.scene.mass);
  std::vector<int32_t> piece;
  const harness::JudgedRun judged =
      harness::judge_run(io::RunSegments("the run", run.frames), [&](int64_t frame, const oracles::RunJudge& judge) {
        if (frame + 1 == kidney.scene.frames) piece = judge.piece_of_particles(true);
      });
  piece.resize(at(kidney.scene.count()), -1);
  const oracles::RunPieces& pieces = judged.pieces;
  row["pieces"] = {{"at_least", pieces.pieces}, {"at_most", pieces.at_most}, {"coupled", pieces.coupled}};
  row["fragments"] =
      std::count_if(pieces.sizes.begin(), pieces.sizes.end(), [](int64_t size) { return size < kFragment; });
  for (const Verdict& verdict : judged.verdicts) {
    if (!verdict.holds) row["fails"].push_back(verdict.property);
  }
  if (with_kicks) {
    row["felt"]["blade_in"] = felt(method, kidney, run, piece, kidney.last_cut);
    row["felt"]["withdrawn"] = felt(method, kidney, run, piece, kidney.last_cut + 2);
  }
  const std::optional<double> spin = spin_kept(method);
  if (spin) row["spin_kept"] = *spin;
  return row;
}

}  // namespace cutproof::benchmarks
