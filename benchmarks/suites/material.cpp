#include "benchmarks/material.h"

#include <fmt/format.h>

#include "benchmarks/suites/suites.h"
#include "model/io/json_number.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

namespace {

void check(const MaterialOptions& options) {
  for (const std::string& along : options.along) {
    require_option(along == "100" || along == "110" || along == "111", "--along",
                   fmt::format("'{}' is no axis of a bar", along), "use 100, 110 or 111");
  }
  for (const int32_t side : options.sides)
    require_option(side >= 1 && side <= 20, "--sides", fmt::format("{} is out of bounds", side), "give 1 to 20 nodes");
  for (const double nu : options.poisson_ratios)
    require_option(nu >= 0 && nu <= 0.49, "--poisson-ratio", fmt::format("{} is out of bounds", nu), "give 0 to 0.49");
  for (const int32_t across : options.across)
    require_option(across >= 4 && across <= 100, "--across", fmt::format("{} is out of bounds", across),
                   "give 4 to 100 nodes");
  for (const int32_t count : options.iterations)
    require_option(count >= 1 && count <= 10'000, "--iterations", fmt::format("{} is out of bounds", count),
                   "give 1 to 10000");
}

}  // namespace

nlohmann::json run_material(const MaterialOptions& options, const Progress& progress) {
  check(options);
  const std::unique_ptr<Backend> backend = make_timed_backend(options.backend);
  constexpr std::size_t kFigures = 7;
  const std::size_t bars = options.cooking.size() * options.sides.size() * options.poisson_ratios.size() *
                           options.across.size() * options.along.size();
  Report report(
      "material", options.backend,
      {{"precision", name_of(backend->precision())}, {"rows_at_most", bars * (kFigures + options.iterations.size())}},
      progress);
  BarSpec spec;
  const auto add = [&](const MaterialBar& bar, const MaterialFigure& figure) {
    report.add(nlohmann::json{{"along", spec.along},
                              {"cooking", name_of(spec.cooking)},
                              {"side", spec.side},
                              {"poisson_ratio", spec.poisson_ratio},
                              {"across", spec.across},
                              {"particles", bar.particles()},
                              {"clusters", bar.clusters()},
                              {"iterations", spec.iterations > 0 ? nlohmann::json(spec.iterations) : nlohmann::json()},
                              {"test", figure.test},
                              {"quantity", figure.quantity},
                              {"unit", figure.unit},
                              {"asked", figure.asked},
                              {"measured", json_number(figure.measured)}});
  };
  for (const std::string& cooking : options.cooking) {
    spec.cooking = cooking_of(cooking);
    for (const std::string& along : options.along) {
      spec.along = along;
      for (const int32_t across : options.across) {
        spec.across = across;
        for (const int32_t side : options.sides) {
          spec.side = side;
          for (const double nu : options.poisson_ratios) {
            spec.poisson_ratio = nu;
            MaterialBar bar(*backend, spec);
            require_option(bar.clusters() > 1, "--sides",
                           fmt::format("{} gives a bar of one cluster, which is rigid", side),
                           "give less than half of --across");
            for (const MaterialFigure& figure : bar.hang()) add(bar, figure);
            for (const auto test : {&MaterialBar::pull, &MaterialBar::swing_along, &MaterialBar::twist,
                                    &MaterialBar::swing_across, &MaterialBar::decay})
              add(bar, (bar.*test)());
            for (const int32_t iterations : options.iterations) {
              if (along != "100") break;
              spec.iterations = iterations;
              MaterialBar few(*backend, spec);
              add(few, few.swing_along());
            }
            spec.iterations = 0;
          }
        }
      }
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
