// The way to standard output and standard error: nothing that came from files gets through as it is.
#pragma once
#include <cstdio>
#include <string_view>

namespace cutproof::cli {

// From this call on, text to standard output (stdout, not the descriptor) is made printable (model/printable.h). Line
// ends, tabs and JSON from io::json_text() stay unchanged. Errors of writing show by fflush and ferror. To be called
// once, before anything is printed. Throws std::bad_alloc.
void make_output_printable();

// Lets colours, bold and faint through ("ESC [ numbers m"), for a program that colours its output. A name from outside
// can use these too, but cannot hide text.
void let_colours_through();

// The same at once, for standard error; allocates nothing.
void print_printable(std::FILE* file, std::string_view text);

}  // namespace cutproof::cli
