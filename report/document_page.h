// A page of documents that are no run: campaigns, measurements, counterexamples.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "report/html.h"
#include "report/pictures.h"
#include "report/sheet.h"

namespace cutproof::report {

// One run of a counterexample: the backend's, or the reference's beside it.
struct Side {
  std::string name;  // "backend host"
  Pictures pictures;
};
// What the 3D view shows of a counterexample: of each side the same body.
struct Scenery {
  nlohmann::json body;      // body_json()
  nlohmann::json blade;     // blade_json()
  std::vector<Side> sides;  // the first is the one in which it fails, if it does
  std::string property;     // that fails; empty: none does
  std::string text;         // its witness in words
};
// As a page describes a body and its blade.
nlohmann::json body_json(const Setup& setup, int32_t kept);
// Its size and its way; null without one.
nlohmann::json blade_json(const Setup& setup);

// So many counterexamples are shown in the 3D view, and about so many bytes of it are pictures at most.
inline constexpr std::size_t kMostSceneries = 12;
inline constexpr int64_t kMostSceneryBytes = int64_t{14} << 20;

// Cards refer to sceneries by number, over all sheets.
std::string document_page(const std::vector<Sheet>& sheets, const std::vector<Scenery>& sceneries, const Made& made);

}  // namespace cutproof::report
