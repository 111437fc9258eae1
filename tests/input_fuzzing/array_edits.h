// What the targets on files of arrays share.
#pragma once
#include <string_view>

#include "model/io/array_file.h"

namespace cutproof::input_fuzzing {

// Bytes of an edit: which array; what is done; where; a value of eight bytes.
inline constexpr std::size_t kEditBytes = 11;
// As many edits as there are bytes for.
void edit(io::ArrayFile& file, std::string_view bytes);

}  // namespace cutproof::input_fuzzing
