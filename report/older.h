// Documents that older versions have written, with the names that today's readers know. results_schema.md says what
// changed from version to version.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "report/field.h"

namespace cutproof::report {

struct Renamed {
  nlohmann::json document;         // holds what the older one holds, and nothing that it does not say
  std::vector<std::string> notes;  // what it lacks and what it means otherwise, as sentences
};

// Of a document of fuzz, bench or tune of an earlier format_version; nothing for one of today's. Throws InputError,
// naming the field, for a version that there never was, or that came later.
std::optional<Renamed> renamed(const Field& document);

// Its format_version is an earlier one: it may lack what today's must have.
bool is_older(const Field& document);

}  // namespace cutproof::report
