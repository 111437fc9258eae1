// The page of kicks: the run with the first kick that fails, and how far each particle is from the run without it.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "harness/recorded_kick.h"

namespace cutproof::cli {

// `document`: what --json writes; `again`: the command line.
void write_kick_page(const std::string& path, const harness::RecordedKick& kick, const oracles::KickReport& report,
                     nlohmann::json document, const std::string& again);

}  // namespace cutproof::cli
