// The part of a recording that stays constant: a Setup in the group /setup of the index.
#pragma once
#include <hdf5.h>

#include <cstdint>

#include "model/io/hdf5_file.h"
#include "model/setup.h"

namespace cutproof::io {

// Both throw hdf5::Error; what is read is not yet checked by defect_of.
void write_setup(hid_t file, const Setup& setup);
// `format`: of the recording, which lacks what is newer (SetupField::since).
Setup read_setup(hid_t file, hdf5::InflationBudget& budget, int32_t format);

}  // namespace cutproof::io
