// The page of a relation: the first run, and beside it the other one, brought back to where the first one is.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/related_runs.h"
#include "oracles/runs/run_map.h"

namespace cutproof::cli {

// `files`: the runs as they were given; `document`: what --json writes; `again`: the command line.
void write_relate_page(const std::string& path, const oracles::RunMap& map, const std::vector<std::string>& files,
                       const harness::JudgedRelation& judged, const nlohmann::json& document, const std::string& again);

}  // namespace cutproof::cli
