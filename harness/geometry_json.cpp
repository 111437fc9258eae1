#include "harness/geometry_json.h"

#include <optional>

#include "model/io/json_number.h"

namespace cutproof::harness {

using nlohmann::json;

json to_json(const oracles::CutGeometry& geometry) {
  return {{"cut_area", json_number(geometry.cut_area)},
          {"lost_volume", json_number(geometry.lost_volume)},
          {"lost_per_area", json_number(geometry.lost_per_area)},
          {"least_per_area", json_number(geometry.least_per_area)},
          {"hausdorff", json_number(geometry.hausdorff())},
          {"skin_to_ideal", json_number(geometry.skin_to_ideal)},
          {"skin_rms", json_number(geometry.skin_rms)},
          {"ideal_to_skin", json_number(geometry.ideal_to_skin)},
          {"sampling", {{"skin_to_ideal", geometry.sampling_skin}, {"ideal_to_skin", geometry.sampling_ideal}}}};
}

json to_json(const oracles::Interpenetration& found) {
  return {{"volume", json_number(found.volume)}, {"bound", json_number(found.bound)}};
}

}  // namespace cutproof::harness
