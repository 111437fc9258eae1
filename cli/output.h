// Output of the program: standard output, and documents.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::cli {

// Flushes printed output to the system. Throws MachineError if this or earlier output cannot be written. A closed
// reader is no error: it asks to stop (interruption.h).
void flush_output();

// First line of the output of every suite and of `tune`, from the head of its document (io::filled).
inline constexpr const char* kHead = "{backend} on {device}, {date}\n";

// The name of an output that stands for standard output.
inline constexpr const char* kStandardOutput = "-";
// If an output of the command line is standard output, text goes to standard error instead, so that standard output
// holds the document alone. Throws InputError if there are several such outputs, or for an output that cannot be
// standard output.
void divert_standard_output(const CLI::App& program);

// Fails before the measurements, not after them: throws InputError if the folder does not exist or is not writable.
// Nothing if `path` is empty or standard output.
void require_writable(const std::string& path);
// Makes a folder that is not there. Throws InputError, naming the option, if that cannot be done or it is not writable.
void make_folder(const std::string& option, const std::string& path);
// Writes the whole text or nothing; to the original standard output if divert_standard_output() found it. Nothing if
// `path` is empty.
void write_output(const std::string& path, const std::string& text);
void write_document(const std::string& path, const nlohmann::json& document);
// Writes an incomplete document, kept in a file if later work fails. Nothing for standard output.
void keep_document(const std::string& path, const nlohmann::json& so_far);
// Says that an output was written, if it is a file.
void print_written(const std::string& path);

}  // namespace cutproof::cli
