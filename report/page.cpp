#include "report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/error.h"
#include "model/io/json_number.h"
#include "model/io/json_text.h"
#include "oracles/property_count.h"
#include "report/assets.h"
#include "report/coding.h"
#include "report/document_page.h"

namespace cutproof::report {

namespace {

using nlohmann::json;

json finding_json(const Finding& finding, const Marks& marks) {
  return {{"property", finding.property},
          {"stage", name_of(finding.stage)},
          {"frame", finding.frame},
          {"measured", finding.measured},
          {"bound", finding.bound},
          {"unit", finding.unit},
          {"ofBound", json_number(finding.of_bound)},
          {"source", finding.bound_source},
          {"text", finding.text},
          {"expected", finding.is_expected},
          {"clusters", finding.clusters},
          {"frames", finding.frames},
          {"marks", to_json(marks)}};
}

json row_json(const PropertyRow& row) {
  return {{"property", row.property},
          {"stage", name_of(row.stage)},
          {"unit", row.unit},
          {"source", row.bound_source},
          {"judged", row.judged},
          {"checked", row.checked},
          {"failed", row.failed},
          {"expected", row.expected},
          {"inconclusive", row.inconclusive},
          {"vacuous", row.vacuous},
          {"frame", row.frame},
          {"measured", row.measured},
          {"bound", row.bound},
          {"ofBound", json_number(row.of_bound)},
          {"asksWider", oracles::asks_wider(row.property)},
          {"ofJudging", oracles::is_of_the_judging(row.property)}};
}

json series_json(const std::vector<Series>& all) {
  json list = json::array();
  for (const Series& one : all) {
    json values = json::array();
    for (const std::optional<double>& value : one.values) values.push_back(json_number(value));
    list.push_back({{"name", one.name}, {"values", std::move(values)}});
  }
  return list;
}

json frames_json(const std::vector<FrameEnd>& frames) {
  json columns = json::object();
  for (const auto& [name, member] : {std::pair{"frame", &FrameEnd::frame},
                                     {"particles", &FrameEnd::particles},
                                     {"clusters", &FrameEnd::clusters},
                                     {"components", &FrameEnd::components},
                                     {"triangles", &FrameEnd::triangles},
                                     {"removed", &FrameEnd::removed}}) {
    json& column = columns[name] = json::array();
    for (const FrameEnd& frame : frames) column.push_back(frame.*member);
  }
  return columns;
}

std::string thinned_in_words(const Pictures& pictures, int32_t particles, bool is_foreign) {
  std::string words;
  if (pictures.thinning.every_frame > 1) {
    words += fmt::format("To keep this page small, it shows one frame in {}, {} in which something fails. ",
                         pictures.thinning.every_frame,
                         is_foreign ? "and those" : "at its end, and every stage of the frames");
  }
  if (pictures.thinning.every_particle > 1) {
    words += fmt::format(
        "It shows {} of {} particles, among them all that a failing verdict names; the skin is whole, "
        "and takes its colours from particles nearby. ",
        pictures.particles, particles);
  }
  if (pictures.own.patches_left_out > 0) {
    words += fmt::format("Of the blade's sweep {} patches are not drawn. ", pictures.own.patches_left_out);
  }
  return words;
}

json data_json(const Source& source, const Results& results, const Pictures& pictures, const std::string& again,
               const Made& made) {
  json rows = json::array(), findings = json::array();
  for (const PropertyRow& row : results.rows) rows.push_back(row_json(row));
  for (std::size_t k = 0; k < results.findings.size(); ++k)
    findings.push_back(finding_json(results.findings[k], pictures.marks[k]));
  return {{"summary", summary_sentence(results)},
          {"command", results.command},
          {"scene", results.scene},
          {"backend", results.backend},
          {"judgedBy", results.version},
          {"made", to_json(made)},
          {"checked", results.checked},
          {"holds", results.holds},
          {"verdicts", results.verdicts},
          {"again", again},
          {"rows", std::move(rows)},
          {"findings", std::move(findings)},
          {"findingsLeftOut", results.findings_left_out},
          {"notes", results.notes},
          {"notReached", results.not_reached},
          {"seconds", series_json(results.seconds)},
          {"errors", series_json(results.errors)},
          {"frames", frames_json(pictures.frames)},
          {"body", body_json(source.setup, pictures.particles)},
          {"blade", blade_json(source.setup)},
          {"moments", pictures.own.details},
          {"firstMoment", pictures.own.first_moment},
          {"comparison", pictures.comparison},
          {"besideMoments", pictures.beside.details},
          {"besideFirst", pictures.beside.first_moment},
          {"reach",
           {{pictures.reach_low.x, pictures.reach_low.y, pictures.reach_low.z},
            {pictures.reach_high.x, pictures.reach_high.y, pictures.reach_high.z}}},
          {"loss", std::max(pictures.own.loss, pictures.beside.loss)},
          {"thinned", thinned_in_words(pictures, source.setup.body.particle_count(), source.is_foreign())},
          // A run of somebody else's has frames without stages; with or without pieces, which need tissue.
          {"foreign", source.is_foreign()},
          {"hasPieces", !source.is_foreign() || !results.pieces.empty()},
          {"opens", results.opens}};
}

}  // namespace

bool has_pages() { return !kPageScript.empty(); }

void require_pages(const std::string& option) {
  if (has_pages()) return;
  throw InputError("cutproof", option, "this program was built without report pages",
                   "install the packages esbuild and libjs-three (ci/install.sh does), configure and build again; "
                   "--json has the same verdicts");
}

void require_same_run(const io::Recording& recording, const std::string& scene, const std::string& recording_file,
                      const Results& results, const std::string& results_file) {
  const auto refuse = [&](const std::string& field, const std::string& of_results, const std::string& of_recording) {
    throw InputError(results_file, field,
                     fmt::format("these are results of {}, and {} holds {}", of_results, recording_file, of_recording),
                     "give the results of the run that was recorded, or leave them out");
  };
  if (!scene.empty() && results.scene != scene) refuse("scene", "scene " + results.scene, "scene " + scene);
  if (results.backend != recording.backend)
    refuse("backend", "backend " + results.backend, "backend " + recording.backend);
  const int64_t particles = recording.setup.body.particle_count();
  if (results.particles && *results.particles != particles)
    refuse("body.particles", fmt::format("{} particles", *results.particles), fmt::format("{}", particles));
}

void require_same_body(const io::Recording& recording, const std::string& recording_file, const io::Recording& other,
                       const std::string& other_file) {
  const Body &one = recording.setup.body, &two = other.setup.body;
  const auto refuse = [&](const std::string& field, const std::string& problem) {
    throw InputError(other_file, field, problem,
                     "give two recordings of one scene: with the same particles, from the same seed");
  };
  if (one.particle_count() != two.particle_count()) {
    refuse("setup/body", fmt::format("this body has {} particles, and that of {} has {}", two.particle_count(),
                                     recording_file, one.particle_count()));
  }
  if (one.grid.spacing != two.grid.spacing) {
    refuse("setup/body", fmt::format("the spacing of this body is {} m, and that of {} is {} m", two.grid.spacing,
                                     recording_file, one.grid.spacing));
  }
  for (int32_t i = 0; i < one.particle_count(); ++i) {
    if (!(one.rest_position(i) == two.rest_position(i)))
      refuse("setup/body", fmt::format("particle {} rests elsewhere than in {}", i, recording_file));
  }
}

Results unjudged(const io::Recording& recording, const std::string& scene) {
  Results results;
  results.command = "recording";
  results.scene = scene;
  results.backend = recording.backend;
  return results;
}

std::string page(const Source& source, const Results& results, const std::string& again, const Made& made,
                 const Beside* beside, int64_t most_picture_bytes) {
  const Pictures pictures = pictures_of(source, results.findings, most_picture_bytes, beside);
  const std::string data = script_json(io::json_text(data_json(source, results, pictures, again, made)));
  return html(data, pictures.own.text, pictures.beside.text);
}

}  // namespace cutproof::report
