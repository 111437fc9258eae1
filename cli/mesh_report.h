// Repairs of a mesh, and differences of a body from its scene: printed, and for --json.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "fixtures/build.h"
#include "fixtures/import/mesh.h"

namespace cutproof::cli {

// --unit of a mesh's numbers: mm, cm or m, and no other word.
CLI::Option* add_unit(CLI::App& command, std::string& unit);
// Metres per such a unit.
double metres_per(const std::string& unit);

// Shows the progress of repair on the terminal.
fixtures::OnRepairStep repair_progress();

// Nothing if nothing was repaired and there is nothing to note.
void print_build(const fixtures::BuildReport& built);
// docs/reference/json.md, The build.
nlohmann::json build_json(const fixtures::BuildReport& built);

void print_examination(const fixtures::MeshExamination& mesh, const std::string& unit);
nlohmann::json examination_json(const fixtures::MeshExamination& mesh, const std::string& file, double unit);

}  // namespace cutproof::cli
