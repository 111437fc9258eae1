// The part of a recording that stays constant: a Setup in the group /setup of the index.
#pragma once
#include <hdf5.h>

#include <optional>
#include <string>

#include "model/setup.h"

namespace cutproof::io {

// The first thing that makes a setup unusable: a field by its path below /setup, and what is wrong, as a sentence.
struct SetupDefect {
  std::string field;
  std::string problem;
};
std::optional<SetupDefect> defect_of(const Setup& setup);

// Both throw hdf5::Error; what is read is not yet checked by defect_of.
void write_setup(hid_t file, const Setup& setup);
Setup read_setup(hid_t file, uint64_t file_bytes);

}  // namespace cutproof::io
