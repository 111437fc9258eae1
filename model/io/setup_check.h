// Whether a setup from a file or from another program can be used.
#pragma once
#include <optional>
#include <string>

#include "model/setup.h"

namespace cutproof::io {

// The first defect of a setup: a field by its group and name ("step/substeps"), and a sentence.
struct SetupDefect {
  std::string field;
  std::string problem;
};
std::optional<SetupDefect> defect_of(const Setup& setup);

}  // namespace cutproof::io
