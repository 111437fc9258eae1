#include "report/document_page.h"

#include "model/io/json_text.h"
#include "report/coding.h"
#include "report/html.h"

namespace cutproof::report {

using nlohmann::json;

json body_json(const Setup& setup, int32_t kept) {
  const Body& body = setup.body;
  return {
      {"name", body.name},        {"particles", body.particle_count()}, {"kept", kept}, {"spacing", body.grid.spacing},
      {"onGrid", body.on_grid()}, {"orientation", body.orientation.m}};
}

json blade_size_json(const Setup& setup) {
  if (!setup.has_blade) return nullptr;
  return {setup.blade.length, setup.blade.depth, setup.blade.thickness};
}

namespace {

json side_json(const Side& side, std::vector<std::string>& chunks) {
  const Pictures& pictures = side.pictures;
  const std::size_t first = chunks.size();
  chunks.insert(chunks.end(), pictures.own.text.begin(), pictures.own.text.end());
  json marks = nullptr;
  if (!pictures.marks.empty()) marks = to_json(pictures.marks.front());
  return {{"name", side.name},
          {"moments", pictures.own.details},
          {"firstMoment", pictures.own.first_moment},
          {"firstChunk", first},
          {"marks", std::move(marks)},
          {"loss", pictures.own.loss},
          {"nowhere", pictures.own.nowhere},
          {"thinned", pictures.thinning != Thinning()},
          {"reach",
           {{pictures.reach_low.x, pictures.reach_low.y, pictures.reach_low.z},
            {pictures.reach_high.x, pictures.reach_high.y, pictures.reach_high.z}}}};
}

}  // namespace

std::string document_page(const std::vector<Sheet>& sheets, const std::vector<Scenery>& sceneries,
                          const std::string& program) {
  std::vector<std::string> chunks;
  json shown = json::array(), views = json::array();
  for (const Sheet& sheet : sheets) shown.push_back(to_json(sheet));
  for (const Scenery& scenery : sceneries) {
    json sides = json::array();
    for (const Side& side : scenery.sides) sides.push_back(side_json(side, chunks));
    views.push_back({{"body", scenery.body},
                     {"blade", scenery.blade},
                     {"property", scenery.property},
                     {"text", scenery.text},
                     {"sides", std::move(sides)}});
  }
  const json data = {{"sheets", std::move(shown)}, {"sceneries", std::move(views)}, {"program", program}};
  return html(script_json(io::json_text(data)), chunks);
}

}  // namespace cutproof::report
