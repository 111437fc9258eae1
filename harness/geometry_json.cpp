#include "harness/geometry_json.h"

#include <optional>

#include "model/io/json_number.h"

namespace cutproof::harness {

namespace {

using nlohmann::json;

json number_or_null(const std::optional<double>& value) { return value ? json_number(*value) : json(nullptr); }

}  // namespace

json to_json(const oracles::CutGeometry& geometry) {
  return {{"cut_area", json_number(geometry.cut_area)},
          {"lost_volume", json_number(geometry.lost_volume)},
          {"lost_per_area", number_or_null(geometry.lost_per_area)},
          {"least_per_area", number_or_null(geometry.least_per_area)},
          {"hausdorff", number_or_null(geometry.hausdorff())},
          {"skin_to_ideal", number_or_null(geometry.skin_to_ideal)},
          {"ideal_to_skin", number_or_null(geometry.ideal_to_skin)},
          {"sampling", {{"skin_to_ideal", geometry.sampling_skin}, {"ideal_to_skin", geometry.sampling_ideal}}}};
}

json to_json(const oracles::Interpenetration& found) {
  return {{"volume", json_number(found.volume)}, {"bound", json_number(found.bound)}};
}

}  // namespace cutproof::harness
