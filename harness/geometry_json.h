// Figures of a cut in result documents (docs/reference/schemas/errors.json); null where something is absent.
#pragma once
#include <nlohmann/json.hpp>

#include "oracles/comparison/cut_geometry.h"
#include "oracles/comparison/interpenetration.h"

namespace cutproof::harness {

nlohmann::json to_json(const oracles::CutGeometry& geometry);
nlohmann::json to_json(const oracles::Interpenetration& found);

}  // namespace cutproof::harness
