// The way to standard output and standard error: nothing that came from files gets through as it is.
#pragma once
#include <cstdio>
#include <string_view>

namespace cutproof::cli {

// From here on, whatever is printed to standard output (stdout, not the descriptor) is made printable
// (model/printable.h) on its way; line ends and tabs stay, and so does JSON that io::json_text() made. Errors of
// writing show as ever, by fflush and ferror. To be called once, before anything is printed. Throws std::bad_alloc.
void make_output_printable();

// Lets colours, bold and faint through ("ESC [ numbers m"), for a program that colours its output. Of what a name from
// outside can do, these are all that gets through then: nothing hides.
void let_colours_through();

// The same at once, for standard error; allocates nothing.
void print_printable(std::FILE* file, std::string_view text);

}  // namespace cutproof::cli
