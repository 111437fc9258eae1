#include "benchmarks/suites/factors.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <utility>

#include "benchmarks/cut_cube.h"
#include "model/error.h"
#include "oracles/comparison/reference_solution.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

constexpr int32_t kCore = 5, kFineCore = 2;

void check(const FactorsOptions& options) {
  for (const auto& [name, sides] : {std::pair{"--sides", &options.sides}, {"--fine-sides", &options.fine_sides}}) {
    for (const int32_t side : *sides) {
      if (side >= 8 && side <= 200) continue;
      throw InputError("command line", name, fmt::format("{} is out of bounds", side), "give numbers from 8 to 200");
    }
  }
}

std::vector<FactorsRow> measure_cut(const CutCube& cube, const Cut& cut, const FactorsOptions& options,
                                    std::mt19937_64& random) {
  const double kdt2 = kCutCubeStiffness * kCutCubeSubstepLength * kCutCubeSubstepLength;
  const SystemChange change = change_of(cube.setup.body, cut.before, cut.after, kdt2 / (1 + kdt2));
  std::vector<double> right(change.origin.size());
  for (double& value : right) value = std::uniform_real_distribution<double>(-1, 1)(random);
  std::vector<FactorsRow> rows;
  for (const Way way : kWays) {
    std::vector<double> seconds, solving;
    std::optional<Factorised> last;
    for (int64_t repeat = 0; repeat < options.repeats; ++repeat) {
      last = factorise(change, way, right);
      if (!last) break;
      seconds.push_back(last->seconds);
      solving.push_back(last->solve_seconds);
    }
    if (!last) continue;
    FactorsRow row;
    row.cut = cut.name;
    row.removed = std::count(cut.before.alive.begin(), cut.before.alive.end(), 1) -
                  std::count(cut.after.alive.begin(), cut.after.alive.end(), 1);
    row.rows = static_cast<int64_t>(change.origin.size());
    row.changed_rows = static_cast<int64_t>(change.changed.size());
    row.new_rows = change.new_rows;
    row.way = way;
    row.seconds = times_of(seconds);
    row.solve_seconds = times_of(solving);
    row.entries = last->entries;
    row.residual = last->residual;
    row.residual_bound = residual_bound(change, way);
    rows.push_back(std::move(row));
  }
  return rows;
}

void measure_whole_substep(const CutCube& cube, State state, std::mt19937_64& random, FactorsScene& scene) {
  constexpr double kMost = 0.1 * kCutCubeSpacing / kCutCubeSubstepLength;  // [m/s]
  std::uniform_real_distribution<double> speed(-kMost, kMost);
  for (Vec3& v : state.v) v = {speed(random), speed(random), speed(random)};
  state.frame = 0;
  const auto begin = Clock::now();
  const oracles::ReferenceSolution converged = oracles::reference_solution(cube.setup, state);
  scene.substep_seconds = seconds_since(begin);
  scene.alternations = static_cast<int>(converged.alternations);
  scene.converged = converged.converged;
}

json row_json(const FactorsRow& row) {
  return {{"cut", row.cut},
          {"removed", row.removed},
          {"rows", row.rows},
          {"changed_rows", row.changed_rows},
          {"new_rows", row.new_rows},
          {"way", name_of(row.way)},
          {"seconds", to_json(row.seconds)},
          {"solve_seconds", to_json(row.solve_seconds)},
          {"entries", row.entries},
          {"residual", row.residual},
          {"residual_bound", row.residual_bound}};
}

}  // namespace

bool FactorsResult::holds() const {
  return std::all_of(scenes.begin(), scenes.end(), [](const FactorsScene& scene) {
    return std::all_of(scene.rows.begin(), scene.rows.end(), [](const FactorsRow& row) { return row.within(); });
  });
}

json to_json(const FactorsResult& result) {
  json document = begin_document(result.provenance, result.complete);
  document["repeats"] = result.repeats;
  document["seed"] = result.seed;
  document["stiffness"] = kCutCubeStiffness;
  document["substep_seconds"] = kCutCubeSubstepLength;
  document["holds"] = result.holds();
  document["scenes"] = json::array();
  for (const FactorsScene& scene : result.scenes) {
    json rows = json::array();
    for (const FactorsRow& row : scene.rows) rows.push_back(row_json(row));
    document["scenes"].push_back(
        {{"scene", scene.scene},
         {"particles", scene.particles},
         {"clusters", scene.clusters},
         {"memberships", scene.memberships},
         {"rows", rows},
         {"converged_substep",
          {{"seconds", scene.substep_seconds}, {"alternations", scene.alternations}, {"converged", scene.converged}}}});
  }
  return document;
}

FactorsResult run_factors(const FactorsOptions& options, const Progress<FactorsResult>& progress) {
  check(options);
  FactorsResult result;
  result.provenance = provenance_of("factors", harness::kReferenceName);
  result.repeats = options.repeats;
  result.seed = options.seed;
  progress(result);
  std::vector<std::pair<int32_t, int32_t>> scenes;
  for (const int32_t side : options.sides) scenes.emplace_back(side, kCore);
  for (const int32_t side : options.fine_sides) scenes.emplace_back(side, kFineCore);
  for (const auto& [side, core] : scenes) {
    std::mt19937_64 random(options.seed);
    const CutCube cube = make_cut_cube(side, core);
    FactorsScene scene;
    scene.scene = cube.name;
    scene.particles = cube.setup.body.particle_count();
    scene.clusters = cube.state.clusters.count();
    scene.memberships = static_cast<int64_t>(cube.state.clusters.members.size());
    const std::vector<Cut> cuts = cuts_of(cube);
    for (const Cut& cut : cuts) {
      for (FactorsRow& row : measure_cut(cube, cut, options, random)) scene.rows.push_back(std::move(row));
    }
    measure_whole_substep(cube, cuts.back().after, random, scene);
    result.scenes.push_back(std::move(scene));
    result.complete = result.scenes.size() == scenes.size();
    progress(result);
  }
  return result;
}

}  // namespace cutproof::benchmarks
