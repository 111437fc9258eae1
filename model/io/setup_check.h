// Whether a setup can be used: what a file, or another program, has given.
#pragma once
#include <optional>
#include <string>

#include "model/setup.h"

namespace cutproof::io {

// The first thing that makes a setup unusable: a field by its group and name ("step/substeps"), and what is wrong, as a
// sentence.
struct SetupDefect {
  std::string field;
  std::string problem;
};
std::optional<SetupDefect> defect_of(const Setup& setup);

}  // namespace cutproof::io
