// Properties of every backend over random dissections (architecture.md, Properties).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "fixtures/build.h"
#include "fixtures/cook.h"
#include "gpu/backends.h"
#include "gpu/kernels/step/step.cuh"
#include "harness/backends.h"
#include "oracles/comparison/state_difference.h"
#include "oracles/iterates/probe.h"
#include "oracles/relations/relations.h"
#include "property_tests/checking.h"
#include "property_tests/counterexample.h"
#include "property_tests/dissection.h"
#include "property_tests/random.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests {
namespace {

// The input of a backend, in its precision.
Instance load_for(const Backend& backend, const Case& c) {
  Instance loaded = instance_of(c);
  loaded.state = in_arithmetic_of(backend, std::move(loaded.state));
  return loaded;
}

// Claims by compare-and-swap are legal under every schedule and differ between schedules, so equal bits are required of
// the rule that promises them.
Case without_claims(Case c) {
  if (c.merge != MergeRule::none) c.merge = MergeRule::deterministic;
  return c;
}

std::string text_of(const Verdict& verdict) { return verdict.holds ? "" : describe(verdict); }

// --- Properties ---------------------------------------------------------------------------------------------------

std::vector<std::pair<std::string, Counterexample>> saved_counterexamples() {
  const char* folder = std::getenv("CUTPROOF_REGRESSIONS");
  const std::filesystem::path path = folder != nullptr ? folder : CUTPROOF_REGRESSIONS_FOLDER;
  if (!std::filesystem::is_directory(path)) throw std::runtime_error(path.string() + " is not a folder");
  std::vector<std::pair<std::string, Counterexample>> saved;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.path().extension() != ".json") continue;
    saved.emplace_back(entry.path().string(), read_counterexample(entry.path().string()));
  }
  std::sort(saved.begin(), saved.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return saved;
}

TEST_P(EveryBackend, AgreesWithEveryOracleOnSavedCounterexamples) {
  const auto saved = saved_counterexamples();
  for (const auto& [file, counterexample] : saved) {
    const auto failure = counterexample.commands.empty()
                             ? dissect(*GetParam().make(), counterexample.failing, true).failure
                             : history_of(GetParam().make, counterexample.failing, counterexample.commands).failure();
    if (failure) ADD_FAILURE() << file << ": " << describe(*failure);
  }
  std::cout << saved.size() << " saved counterexamples replayed" << std::endl;
}

TEST(SavedCounterexamples, HoldUnderTheScheduleThatBrokeThem) {
  for (const auto& [file, counterexample] : saved_counterexamples()) {
    if (counterexample.schedule.empty()) continue;
    const auto backend = harness::make_replaying_backend(counterexample.schedule);
    const auto judgement = dissect(*backend, counterexample.failing, true);
    if (judgement.failure) ADD_FAILURE() << file << ": " << describe(*judgement.failure);
  }
}

TEST_P(EveryBackend, KeepsEveryInvariantAfterEveryStageOfARandomDissection) {
  CaseCoverage seen;
  int64_t cases = 0, verdicts = 0;
  check(id(), cases_of(1), GetParam().most_size, [&](const Case& c) {
    const Judgement judgement = dissect(*backend_, c, cases % 50 == 0);
    ++cases;
    verdicts += judgement.verdicts;
    seen.add(judgement.coverage);
    return judgement.failure ? describe(*judgement.failure) : "";
  });
  std::cout << cases << " cases, " << verdicts << " verdicts; cases with:";
  report(seen, "case", [](std::size_t k) { return least_count(kCoverageClasses[k], 1, false) > 0; });
}

TEST_P(EveryBackend, OnlyRefinesTheComponentsWithEveryStroke) {
  check(id(), cases_of(10), GetParam().most_size, [&](const Case& c) {
    const Instance loaded = load_for(*backend_, c);
    const int64_t strokes = loaded.setup.frame_count();
    if (strokes == 0) return std::string();
    return text_of(oracles::refinement(*backend_, loaded.setup, loaded.state,
                                       static_cast<int64_t>(c.seed % static_cast<uint64_t>(strokes))));
  });
}

TEST_P(EveryBackend, GivesTheSameBitsTwice) {
  check(id(), cases_of(20), GetParam().most_size, [&](const Case& c) {
    const Instance loaded = load_for(*backend_, without_claims(c));
    return text_of(oracles::determinism(*backend_, loaded.setup, loaded.state, loaded.setup.frame_count()));
  });
}

TEST_P(EveryBackend, RunsAFrameAsTheCompositionOfItsSpans) {
  check(id(), cases_of(20), GetParam().most_size, [&](const Case& c) {
    const Instance loaded = load_for(*backend_, without_claims(c));
    return text_of(oracles::span_composition(*backend_, loaded.setup, loaded.state, loaded.setup.frame_count()));
  });
}

TEST_P(EveryBackend, GivesTheSameAnswerToASceneTurnedShiftedScaledOrRenumbered) {
  check(id(), cases_of(10), GetParam().most_size, [&](const Case& c) {
    const Instance loaded = load_for(*backend_, without_claims(c));
    if (loaded.setup.frame_count() == 0) return std::string();
    // The merged clusters depend on their numbers; without I4 so does the coupling afterwards.
    const bool decided = loaded.state.edge_covered || c.merge == MergeRule::none;
    const Span span = decided ? Span{} : Span{Stage::step, Stage::split};
    return text_of(oracles::equivariance(*backend_, loaded.setup, loaded.state, span, c.seed));
  });
}

// The rest of a body after all strokes, every particle displaced by up to 0.3 h along each axis, and a setup that moves
// it: one frame of one substep of 3 iterations, without a blade.
Instance cut_and_disturbed(Backend& backend, const Case& c) {
  Instance loaded = load_for(backend, c);
  backend.load({loaded.setup}, {loaded.state});
  for (int64_t frame = 0; frame < loaded.setup.frame_count(); ++frame) backend.run({});
  loaded.state = backend.snapshot().front();
  loaded.state.frame = 0;
  Random random(c.seed);
  for (Vec3& x : loaded.state.x) {
    for (int axis = 0; axis < 3; ++axis) x[axis] += random.real(-0.3, 0.3) * c.spacing;
  }
  without_blade(loaded.setup);
  loaded.setup.substep_length = {random.real(0.0005, 0.02)};
  loaded.setup.step.iterations = 3;
  loaded.setup.step.stiffness = std::pow(10, random.real(2, 7));
  loaded.setup.step.acceleration = random.chance(0.5) ? Acceleration::chebyshev : Acceleration::none;
  return loaded;
}

TEST_P(EveryBackend, StepsACutBodyWithoutGhostForcesAndWithoutEnergyFromNowhere) {
  int64_t compared = 0, iterations = 0;
  check(id(), cases_of(10), GetParam().most_size, [&](const Case& c) {
    const Instance cut = cut_and_disturbed(*backend_, c);
    int32_t kicked = 0;
    while (kicked < cut.setup.body.particle_count() && !cut.state.alive[at(kicked)]) ++kicked;
    const Vec3 kick = {0.7 * c.spacing, -0.4 * c.spacing, 1.3 * c.spacing};
    const Verdict verdicts[] = {
        oracles::no_ghost_force(*backend_, cut.setup, cut.state, kicked, kick, 1),
        oracles::energy_is_monotone(*backend_, cut.setup, cut.state, 6),
        oracles::rest_is_fixed(*backend_, cut.setup, cut.state),
        oracles::translation_is_exact(*backend_, cut.setup, cut.state, {0.3, -0.2, 0.1}),
    };
    compared += verdicts[0].checked;
    iterations += verdicts[1].checked;
    for (const Verdict& verdict : verdicts) {
      if (!verdict.holds) return describe(verdict);
    }
    return std::string();
  });
  if (!ran_in_full()) return;
  EXPECT_GT(compared, 0) << "no body had a second component";
  EXPECT_GT(iterations, 0);
}

// Each iterate follows from the one before it, and the last one has the bits of the frame. Iterations that are left out
// change no earlier iterate. (Bits are asked of the state that is loaded: a state that was shown is rounded once more.)
TEST_P(EveryBackend, ShowsEachIterateOfAFrame) {
  ASSERT_TRUE(backend_->shows_iterates()) << "every backend of this project knows Setup::withheld_iterations";
  constexpr Span kStep{Stage::step, Stage::step};
  int64_t compared = 0;
  const auto ends_of = [&](std::vector<cutproof::Setup> setups, const State& begin) {
    std::vector<State> states(setups.size(), begin);
    backend_->load(std::move(setups), std::move(states));
    backend_->run(kStep);
    return backend_->snapshot();
  };
  const auto differ = [](const State& a, const State& b) {
    const std::vector<oracles::FieldDifference> all = oracles::differences_in_bits(a, b);
    return std::string(all.empty() ? "" : all.front().text);
  };
  const auto shown = [&](const Case& c) -> std::string {
    const Instance loaded = load_for(*backend_, c);
    const cutproof::Setup& setup = loaded.setup;
    if (setup.frame_count() == 0 || setup.body.particle_count() == 0) return "";
    const auto iterates = [&](const State& begin) {
      const oracles::IterateProbe probe(setup, begin, oracles::Iterates::all, 0);
      return oracles::shown_iterates(*backend_, {&probe, 1}).front();
    };
    const State end = ends_of({setup}, loaded.state).front();
    const oracles::ShownStep all = iterates(loaded.state);
    if (const std::string what = differ(all.whole ? *all.whole : all.iterates.back(), end); !what.empty()) {
      return what + " at the end of a frame that shows its iterates is not that of one that does not";
    }
    const cutproof::Setup one = oracles::first_substeps(setup, 0, 1);
    for (int32_t left = 0; left <= setup.step.iterations; ++left) {
      cutproof::Setup withheld = one, fewer = one;
      withheld.withheld_iterations = left;
      fewer.step.iterations -= left;
      const std::vector<State> ends = ends_of({withheld, fewer}, loaded.state);
      if (const std::string what = differ(ends[0], ends[1]); !what.empty()) {
        return what + " hangs on iterations that are left out";
      }
    }
    backend_->load({setup}, {loaded.state});
    for (int64_t frame = 0; frame < setup.frame_count() / 2; ++frame) backend_->run({});
    const State before = backend_->snapshot().front();
    const oracles::IterateProbe probe(setup, before, oracles::Iterates::all, 0);
    const Verdict verdict = probe.judged(iterates(before));
    compared += verdict.checked;
    return text_of(verdict);
  };
  const auto deadline = std::make_shared<Deadline>();
  const auto cases = random_cases(deadline, draw_moving_case);
  check(id(), cases_of(10), GetParam().most_size, *deadline, [&] {
    const Case c = *cases;
    return Example{to_json(c), shown(c)};
  });
  if (ran_in_full()) {
    EXPECT_GT(compared, 0);
  }
}

// Blades push against tissue that walls on all three lower sides hold, so that both act on the same particles and are
// projected in turn. Without friction that has an energy.
TEST_P(EveryBackend, GainsNoEnergyBetweenBladeAndWalls) {
  int64_t iterations = 0;
  const auto gained = [&](const Case& c) {
    Case moving = c;
    moving.moves = true;
    Instance loaded = load_for(*backend_, moving);
    auto& setup = loaded.setup;
    setup.step.gravity = {-9.81, -9.81, -9.81};
    setup.walls.clear();
    for (int axis = 0; axis < 3; ++axis) setup.walls.push_back({axis, +1, 0.75 * c.spacing, 0});
    constexpr int64_t kFrames = 4;
    for (int64_t frame = 0; frame < std::min(kFrames, setup.frame_count()); ++frame) {
      const Verdict verdict = oracles::energy_is_monotone(*backend_, setup, loaded.state, 4);
      iterations += verdict.checked;
      if (!verdict.holds) return describe(verdict);
      backend_->load({setup}, {loaded.state});
      backend_->run({});
      loaded.state = backend_->snapshot().front();
    }
    return std::string();
  };
  // A particle whose place becomes worse by less than what refuses it, and whose energy rounding alone would not raise
  // so far (found by 4,000 cases).
  Case hardly_worse;
  hardly_worse.nodes = {{0, 0, 0}};
  hardly_worse.ball_radius = 14;
  hardly_worse.seed_spacing = 5;
  hardly_worse.side = hardly_worse.most = hardly_worse.cap = 1;
  hardly_worse.tau = 0;
  hardly_worse.merge = MergeRule::none;
  hardly_worse.expand = ExpandRule::none;
  hardly_worse.blade_length = 4;
  hardly_worse.blade_thickness = 16;
  hardly_worse.moves = true;
  hardly_worse.substeps = hardly_worse.iterations = 1;
  hardly_worse.strokes = {{{2, 7, -5}, {4, 1, 2}, 5, true, Link::apart}};
  EXPECT_EQ(gained(hardly_worse), "");
  check(id(), cases_of(10), GetParam().most_size, gained);
  if (ran_in_full()) {
    EXPECT_GT(iterations, 0);
  }
}

// Particle counts around the sizes of warps and blocks, and clusters of one to three particles; a cut through the
// middle.
TEST_P(EveryBackend, DissectsBodiesOfSizesAroundThoseOfBlocks) {
  int64_t verdicts = 0;
  for (const int32_t count : {0, 1, 2, 3, 31, 32, 33, 63, 64, 65, 255, 256, 257, 1023, 1024, 1025}) {
    for (const int32_t most : {0, 1, 3}) {  // 0: boxes
      if (count > 300 && GetParam().fraction > 1) continue;
      Case c;
      // The first `count` nodes of a block, row by row; a wire for the smallest.
      const int32_t side = std::max(1, static_cast<int32_t>(std::ceil(std::cbrt(count))));
      for (int32_t i = 0; i < count; ++i) c.nodes.push_back({i / (side * side), i / side % side, i % side});
      if (most > 0) {
        c.clusters = ClusterKind::foreign;
        c.most = most;
        c.tau = 2;
        c.cap = 2 * most;
      }
      c.strokes = {{{2 * side, 2 * side, -4}, {2 * side, 2 * side, 4 * side}, 4, true, Link::apart},
                   {{-4, 2 * side, 2 * side}, {4 * side, 2 * side, 2 * side}, 4, true, Link::apart}};
      c.blade_thickness = 0;
      c.blade_length = 2;
      c.blade_depth = 2 * side + 1;
      const Judgement judgement = dissect(*backend_, c, true);
      verdicts += judgement.verdicts;
      EXPECT_FALSE(judgement.failure) << count << " particles, clusters of at most " << most << ": "
                                      << describe(*judgement.failure);
    }
  }
  EXPECT_GT(verdicts, 100);
}

// --- Bodies too large for simulated schedules -----------------------------------------------------------------------

class LargeBodies : public ::testing::TestWithParam<NamedBackend> {};

// Wires beside each other, and a cluster for every 21 particles in a row. Cutting every third particle out makes far
// more clusters than a batch has room for, so the kernels' backends have to make room between frames.
TEST_P(LargeBodies, FindRoomForMoreClustersThanTheirLoadHadRoomFor) {
  constexpr int32_t kWires = 14, kLength = 90, kInARow = 21;  // kWires along each of two axes
  Case c;
  for (int32_t i = 0; i < kWires; ++i) {
    for (int32_t j = 0; j < kWires; ++j) {
      for (int32_t k = 0; k < kLength; ++k) c.nodes.push_back({2 * i, 2 * j, k});
    }
  }
  c.merge = MergeRule::none;
  c.expand = ExpandRule::none;
  c.blade_thickness = 0;
  for (int32_t k = 1; k < kLength; k += 3) {
    c.strokes.push_back({{-8, -8, 4 * k}, {8 * kWires, -8, 4 * k}, 2, true, Link::apart});
  }
  Instance loaded = instance_of(c);
  loaded.setup.skin.wanted = false;
  const Body& body = loaded.setup.body;
  std::vector<std::vector<int32_t>> clusters;
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    std::vector<int32_t> row = {p};
    for (int32_t q = p; q >= 0 && static_cast<int32_t>(row.size()) < kInARow;) {
      q = body.neighbour(q, 4);
      if (q >= 0) row.push_back(q);
    }
    if (static_cast<int32_t>(row.size()) == kInARow) clusters.push_back(std::move(row));
  }
  const auto before = static_cast<int64_t>(clusters.size());
  loaded.state = fixtures::foreign_state(body, std::move(clusters), 0, kInARow);

  const auto backend = GetParam().make(), reference = reference::make_backend();
  for (Backend* each : {backend.get(), reference.get()}) {
    each->load({loaded.setup}, {loaded.state});
    for (int64_t frame = 0; frame < loaded.setup.frame_count(); ++frame) ASSERT_NO_THROW(each->run({})) << frame;
  }
  const State found = backend->snapshot().front(), expected = reference->snapshot().front();
  EXPECT_EQ(found.alive, expected.alive);
  EXPECT_EQ(found.clusters.number, expected.clusters.number);
  EXPECT_EQ(found.clusters.offsets, expected.clusters.offsets);
  EXPECT_EQ(found.clusters.members, expected.clusters.members);
  EXPECT_GT(found.clusters.count(), 5 * before);
}

std::vector<NamedBackend> backends_for_large_bodies() {
  std::vector<NamedBackend> backends = all_backends();
  std::erase_if(backends, [](const NamedBackend& backend) { return backend.most_size < 100; });
  return backends;
}
INSTANTIATE_TEST_SUITE_P(Over, LargeBodies, ::testing::ValuesIn(backends_for_large_bodies()),
                         [](const auto& tested) { return tested.param.name; });

// --- Paths --------------------------------------------------------------------------------------------------------

using Paths = std::vector<std::pair<std::string, std::unique_ptr<Backend>>>;

// The same work, started in other ways. Eight bodies in a batch: their needs differ, and a small batch is not one small
// body. Each of two of them alone, too.
void expect_same_bits(const std::string& id, int64_t cases, Paths& paths) {
  constexpr int kBodies = 8;
  constexpr int64_t kFrames = 4;
  const auto run = [](Backend& backend, const std::vector<Setup>& setups, const std::vector<State>& states) {
    backend.load(setups, states);
    std::vector<std::vector<State>> all;
    for (int64_t frame = 0; frame < kFrames; ++frame) {
      backend.run({});
      all.push_back(backend.snapshot());
    }
    return all;
  };
  int64_t frames = 0, cut = 0;
  check(id, cases, 100, [&](const Case& drawn) -> std::string {
    std::vector<Setup> setups;
    std::vector<State> states;
    for (int k = 0; k < kBodies; ++k) {
      const uint64_t seed = drawn.seed + static_cast<uint64_t>(k);
      const Case c = k == 0 ? drawn : k % 2 == 0 ? draw_case(seed, 60) : draw_moving_case(seed, 60);
      Instance body = load_for(*paths.front().second, without_claims(c));
      setups.push_back(std::move(body.setup));
      states.push_back(std::move(body.state));
    }
    const auto expected = run(*paths.front().second, setups, states);
    for (const auto& together : expected) {
      ++frames;
      cut += std::any_of(together.begin(), together.end(), [](const State& s) { return !s.removed.empty(); });
    }
    for (auto& [name, backend] : paths) {
      if (run(*backend, setups, states) != expected) return name + " gives other bits in a batch";
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
        const auto alone = run(*backend, {setups[k]}, {states[k]});
        for (std::size_t frame = 0; frame < alone.size(); ++frame) {
          if (alone[frame].front() != expected[frame][k]) return name + " gives other bits alone";
        }
      }
    }
    return "";
  });
  std::cout << frames << " frames of " << kBodies << " bodies over " << paths.size() << " paths; something was cut in "
            << cut << std::endl;
  EXPECT_GT(cut, 0);
}

TEST(Paths, OfTheHostGiveTheSameBitsAloneAndInALoad) {
  Paths paths;
  for (const std::string name : {harness::kHostName, "host-blocks"}) {
    for (const int threads : {1, 2, 32}) {
      harness::BackendChoice choice;
      choice.name = name;
      choice.threads = threads;
      paths.emplace_back(choice.name + " with " + std::to_string(threads) + " threads", harness::make_backend(choice));
    }
  }
  expect_same_bits("Paths.OfTheHostGiveTheSameBitsAloneAndInALoad", std::max<int64_t>(wanted_cases() / 100, 5), paths);
}

TEST(Paths, OfTheDeviceGiveTheBitsOfTheHostAloneAndInALoad) {
  Paths paths;
  for (const harness::BackendDescriptor& backend : harness::backends()) {
    if (!backend.is_built() || !backend.needs_device() || harness::processor_of(backend).empty()) continue;
    harness::BackendChoice choice;
    choice.name = backend.name;
    paths.emplace_back(choice.name, harness::make_backend(choice));
  }
  if (paths.empty()) GTEST_SKIP() << "there is no device";
  ASSERT_GE(paths.size(), 2u);
  // Compares all results with the host's, which come from the same operations in the same order. That finds a product
  // and a sum that a device rounds once instead of twice, and other errors of the size of rounding.
  harness::BackendChoice host;
  host.name = harness::kHostName;
  paths.emplace(paths.begin(), host.name, harness::make_backend(host));
#if CUTPROOF_HAS_CUDA
  // Whatever memory holds before anything is put into it, and where it has to be made first.
  for (const gpu::Path path : {gpu::Path::graph, gpu::Path::eager}) {
    for (const int fill : {0x5a, 0xff, 0x00}) {
      gpu::KernelOptions options;
      options.path = path;
      options.fill = fill;
      if (fill == 0xff) options.on_demand = {1, 0};
      paths.emplace_back(fmt::format("path {} in memory of bytes {}", static_cast<int>(path), fill),
                         gpu::make_gpu_backend(options));
    }
  }
#endif
  expect_same_bits("Paths.OfTheDeviceGiveTheBitsOfTheHostAloneAndInALoad", std::max<int64_t>(wanted_cases() / 20, 5),
                   paths);
}

// A large batch runs other kernels, with fewer lanes for each group and each cluster: large enough for all of these
// kernels.
TEST(Paths, OfTheDeviceGiveTheBitsOfTheHostInALargeLoad) {
  constexpr int32_t kCopies = 72;
  constexpr const char* kDevice = "gpu";
  const harness::BackendDescriptor* const backend = harness::find_backend(kDevice);
  if (backend == nullptr || !backend->is_built() || harness::processor_of(*backend).empty())
    GTEST_SKIP() << "there is no device";
  Scene scene;
  scene.name = "block";
  scene.body.shape = Shape{};
  scene.body.particles = 8000;
  scene.frames = 30;
  scene.grips = {{.low = {0, 0, 0}, .high = {1, 1, 0.1}, .velocity = {}}};
  StrokeSpec stroke;
  stroke.points = {{1.2, 0.5, 0.5}, {0.2, 0.5, 0.5}};
  stroke.back = {1, 0, 0};
  stroke.along = Vec3{0, 1, 0};
  scene.blade = BladeSpec{};
  scene.blade->speed = 0.4;
  scene.blade->strokes = {stroke};
  for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
    scene.step.acceleration = acceleration;
    const fixtures::Built built = fixtures::build(scene, "block");
    const int32_t particles = built.setup.body.particle_count();
    ASSERT_GT(kCopies * built.state.clusters.count(), gpu::step_detail::kFewClusters);
    ASSERT_GT(kCopies * particles, gpu::step_detail::kMostByRows);
    const auto run = [&](const char* name, std::size_t copies) {
      harness::BackendChoice choice;
      choice.name = name;
      const auto kernels = harness::make_backend(choice);
      kernels->load(std::vector<cutproof::Setup>(copies, built.setup), std::vector<State>(copies, built.state));
      for (int64_t frame = 0; frame < scene.frames; ++frame) kernels->run({});
      return kernels->snapshot();
    };
    const State alone = run(harness::kHostName, 1).front();
    EXPECT_GT(std::count(alone.alive.begin(), alone.alive.end(), 0), 0) << "nothing was cut";
    EXPECT_TRUE(run(kDevice, 1).front() == alone);
    for (const State& together : run(kDevice, kCopies)) ASSERT_TRUE(together == alone);
  }
}

// --- The generators themselves ------------------------------------------------------------------------------------

TEST(Cases, ShrinkToTheFewestParticlesAndStrokesThatAPlantedFaultNeeds) {
  // The mutant: a stroke straight down a column of three tissue nodes is not survived.
  const auto fails = [](const Case& c) {
    const auto has = [&](Node node) { return std::find(c.nodes.begin(), c.nodes.end(), node) != c.nodes.end(); };
    const bool column = has({0, 0, 0}) && has({0, 0, 1}) && has({0, 0, 2});
    return column && std::any_of(c.strokes.begin(), c.strokes.end(), [](const Stroke& s) { return s.down; });
  };
  int shrunk = 0;
  for (uint64_t seed = 0; shrunk < 5; ++seed) {
    Case c = draw_case(seed, 60);
    if (!fails(c)) continue;
    c = simplest(c, fails, [] { return false; });
    EXPECT_EQ(c.nodes, (std::vector<Node>{{0, 0, 0}, {0, 0, 1}, {0, 0, 2}})) << "seed " << seed;
    EXPECT_EQ(c.strokes.size(), 1u);
    ++shrunk;
  }
}

}  // namespace
}  // namespace cutproof::property_tests

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  cutproof::property_tests::set_up_rapidcheck();
  return RUN_ALL_TESTS();
}
