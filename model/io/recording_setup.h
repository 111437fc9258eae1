// The part of a recording that stays constant: a Setup in the group /setup of the index.
#pragma once
#include <hdf5.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "model/digest.h"
#include "model/io/hdf5_file.h"
#include "model/setup.h"

namespace cutproof::io {

// Both throw hdf5::Error. Reading does not check the setup by defect_of.
void write_setup(hid_t file, const Setup& setup);
Setup read_setup(hid_t file, hdf5::InflationBudget& budget);

// Digest of the input of a run without the loaded state, which the caller adds.
Digest digest_of_beginning(const Setup& setup, std::string_view scene_json,
                           const std::array<bool, 6>& left_to_reference, std::optional<int64_t> frames_asked);

}  // namespace cutproof::io
