#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <utility>

#include "benchmarks/cut_cube.h"
#include "benchmarks/factorise.h"
#include "benchmarks/suites/suites.h"
#include "oracles/comparison/reference_solution.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

// Every way of having a factor after one cut, and whether each solves the system.
bool measure_cut(const ReadyScene& cube, const Cut& cut, int64_t repeats, std::mt19937_64& random, json& rows) {
  const double kdt2 = kCutCubeStiffness * kCutCubeSubstepLength * kCutCubeSubstepLength;
  const SystemChange change = change_of(cube.setup.body, cut.before, cut.after, kdt2 / (1 + kdt2));
  std::vector<double> right(change.origin.size());
  for (double& value : right) value = std::uniform_real_distribution<double>(-1, 1)(random);
  bool holds = true;
  for (const Way way : kWays) {
    std::vector<double> seconds, solving;
    std::optional<Factorised> last;
    for (int64_t repeat = 0; repeat < repeats; ++repeat) {
      last = factorise(change, way, right);
      if (!last) break;
      seconds.push_back(last->seconds);
      solving.push_back(last->solve_seconds);
    }
    if (!last) continue;
    const double bound = residual_bound(change, way);
    holds = holds && last->residual <= bound;
    rows.push_back({{"cut", cut.name},
                    {"removed", std::count(cut.before.alive.begin(), cut.before.alive.end(), 1) -
                                    std::count(cut.after.alive.begin(), cut.after.alive.end(), 1)},
                    {"rows", change.origin.size()},
                    {"changed_rows", change.changed.size()},
                    {"new_rows", change.new_rows},
                    {"way", name_of(way)},
                    {"seconds", to_json(times_of(seconds))},
                    {"solve_seconds", to_json(times_of(solving))},
                    {"entries", last->entries},
                    {"residual", last->residual},
                    {"residual_bound", bound}});
  }
  return holds;
}

// Of the cut body, when everything in it moves.
json converged_substep(const ReadyScene& cube, State state, std::mt19937_64& random) {
  constexpr double kMost = 0.1 * kCutCubeSpacing / kCutCubeSubstepLength;  // [m/s]
  std::uniform_real_distribution<double> speed(-kMost, kMost);
  for (Vec3& v : state.v) v = {speed(random), speed(random), speed(random)};
  state.frame = 0;
  const auto begin = Clock::now();
  const oracles::ReferenceSolution converged = oracles::reference_solution(cube.setup, state);
  return {
      {"seconds", seconds_since(begin)}, {"alternations", converged.alternations}, {"converged", converged.converged}};
}

}  // namespace

json run_factors(const FactorsOptions& options, const Progress& progress) {
  std::vector<std::pair<int32_t, int32_t>> scenes;  // sides of the cube and of the cores of its clusters
  const auto take = [&](const char* option, const std::vector<int32_t>& sides, int32_t core) {
    for (const int32_t side : sides) {
      require_option(side >= 8 && side <= 200, option, fmt::format("{} is out of bounds", side),
                     "give numbers from 8 to 200");
      scenes.emplace_back(side, core);
    }
  };
  take("--sides", options.sides, 5);
  take("--fine-sides", options.fine_sides, 2);
  Report report("factors", harness::kReferenceName,
                {{"repeats", options.repeats},
                 {"seed", options.seed},
                 {"stiffness", kCutCubeStiffness},
                 {"substep_seconds", kCutCubeSubstepLength},
                 {"rows_at_most", scenes.size()},
                 {"holds", true}},
                progress, "scenes");
  for (const auto& [side, core] : scenes) {
    std::mt19937_64 random(options.seed);
    const ReadyScene cube = make_cut_cube(side, core);
    const std::vector<Cut> cuts = cuts_of(cube);
    json rows = json::array();
    bool holds = true;
    for (const Cut& cut : cuts) holds &= measure_cut(cube, cut, options.repeats, random, rows);
    report.add({{"scene", cube.name},
                {"particles", cube.setup.body.particle_count()},
                {"clusters", cube.state.clusters.count()},
                {"memberships", cube.state.clusters.members.size()},
                {"rows", std::move(rows)},
                {"converged_substep", converged_substep(cube, cuts.back().after, random)}},
               holds);
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
