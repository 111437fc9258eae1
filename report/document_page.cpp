#include "report/document_page.h"

#include <algorithm>

#include "model/io/json_text.h"
#include "report/coding.h"

namespace cutproof::report {

using nlohmann::json;

json body_json(const Setup& setup, int32_t kept) {
  const Body& body = setup.body;
  return {
      {"name", body.name},        {"particles", body.particle_count()}, {"kept", kept}, {"spacing", body.grid.spacing},
      {"onGrid", body.on_grid()}, {"orientation", body.orientation.m}};
}

namespace {

// Of each stroke where the blade's edge is, so often that a page holds about so many places of all strokes.
constexpr std::size_t kMostPoses = 150;

json way_json(const std::vector<BladeMove>& moves) {
  std::vector<std::vector<const BladePose*>> strokes;
  std::size_t count = 0;
  bool was_down = false;
  for (const BladeMove& move : moves) {
    if (move.down && !was_down) strokes.push_back({&move.from});
    if (move.down) strokes.back().push_back(&move.to);
    count += move.down;
    was_down = move.down;
  }
  const std::size_t every = count / kMostPoses + 1;
  json way = json::array();
  for (const auto& stroke : strokes) {
    json places = json::array();
    for (std::size_t k = 0; k < stroke.size(); ++k) {
      if (k % every != 0 && k + 1 != stroke.size()) continue;
      for (const Vec3& vector : {stroke[k]->edge, stroke[k]->along}) {
        for (int axis = 0; axis < 3; ++axis) places.push_back(static_cast<float>(vector[axis]));
      }
    }
    way.push_back(std::move(places));
  }
  return way;
}

}  // namespace

json blade_json(const Setup& setup) {
  if (!setup.has_blade) return nullptr;
  return {{"size", {setup.blade.length, setup.blade.depth, setup.blade.thickness}},
          {"way", way_json(setup.blade_moves)}};
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
          {"thinned", pictures.thinning != Thinning()},
          {"reach",
           {{pictures.reach_low.x, pictures.reach_low.y, pictures.reach_low.z},
            {pictures.reach_high.x, pictures.reach_high.y, pictures.reach_high.z}}}};
}

}  // namespace

std::string document_page(const std::vector<Sheet>& sheets, const std::vector<Scenery>& sceneries, const Made& made) {
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
  const json data = {{"sheets", std::move(shown)}, {"sceneries", std::move(views)}, {"made", to_json(made)}};
  return html(script_json(io::json_text(data)), chunks);
}

}  // namespace cutproof::report
