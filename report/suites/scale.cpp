#include "report/suites/over_sizes.h"

namespace cutproof::report {

namespace {

std::optional<double> bytes_of_a_particle(const Field& row) {
  const auto particles = static_cast<double>(row["particles"].count());
  const std::optional<double> bytes = row["bytes"].number_or_null();
  return bytes && particles > 0 ? std::optional(*bytes / particles) : std::nullopt;
}

RowColumns columns_of_scale() {
  return scene_columns({{"million particles/s", "{1e-6*particles_per_second:.4g}"},
                        {"MB", "{1e-6*bytes:.4g}", Shown::terminal},
                        {"bytes/particle", [](const Field& row) {
                           const std::optional<double> bytes = bytes_of_a_particle(row);
                           return bytes ? fmt::format("{:.0f}", *bytes) : "";
                         }}});
}

void add_scale(Sheet& sheet, const Field& document) {
  TimedScenes scenes(document, columns_of_scale());
  Chart chart =
      over_particles("Time over size", "Each stage and the whole frame by number of particles, both axes logarithmic.");
  Chart memory = {"Memory over size",
                  "What the backend keeps after the timed frames, for each particle.",
                  {"particles", "", true},
                  {"memory of a particle", "bytes", false},
                  {}};
  document["rows"].each([&](const Field& row) {
    scenes.add(row);
    const std::string variant = scenes.variants.of(row), scene = scenes.variants.scene_of(row);
    const auto size = static_cast<double>(row["particles"].count());
    const auto add = [&](const std::string& what, bool is_always) {
      const std::optional<double> median = in_ms(row["seconds"][what.c_str()]);
      if (!median && !is_always) return;
      curve_named(chart, with(what, variant), Look::joined)
          .dots.push_back({size, median, fmt::format("{} of {}: {}", what, scene, solver_text(row))});
    };
    for (const std::string_view stage : kStageNames) add(std::string(stage), false);
    add("frame", true);
    curve_named(memory, with("memory", variant), Look::joined)
        .dots.push_back(
            {size, bytes_of_a_particle(row), fmt::format("{}: {} clusters", scene, row["clusters"].count())});
  });
  sort_by_x(chart);
  sort_by_x(memory);
  sheet.pieces.emplace_back(std::move(chart));
  scenes.show_stack(sheet);
  sheet.pieces.emplace_back(std::move(memory));
  scenes.show_tables(sheet, document, false);
  sheet.summary = "Times of a frame and of its stages, and memory, by number of particles.";
}

}  // namespace

const Suite kScaleSuite = {"scale", "rows", columns_of_scale, add_scale};

}  // namespace cutproof::report
