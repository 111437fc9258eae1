// What the program writes: standard output, and documents.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::cli {

// Flushes printed output to the system. Throws MachineError if this or earlier output cannot be written. A closed
// reader is no error: it asks to stop (interruption.h).
void flush_output();

// With what the output of every suite and of `tune` begins, of the head of its document (io::filled).
inline constexpr const char* kHead = "{backend} on {device}, {date}\n";

// The name of an output that stands for standard output.
inline constexpr const char* kStandardOutput = "-";
// Looks for it among the outputs of the command line: then what is printed goes to standard error instead, so that
// standard output holds the document alone. Throws InputError if there are several, or it is one that cannot be.
void divert_standard_output(const CLI::App& program);

// Nothing if `path` is empty or standard output, else a failure now rather than after the measurements: throws
// InputError if the folder is not there or not writable.
void require_writable(const std::string& path);
// Makes a folder that is not there. Throws InputError, naming the option, if that cannot be done or it is not writable.
void make_folder(const std::string& option, const std::string& path);
// The whole text or nothing, to standard output what divert_standard_output() has left free; nothing if `path` is
// empty.
void write_output(const std::string& path, const std::string& text);
void write_document(const std::string& path, const nlohmann::json& document);
// What there is of a document that grows: kept in a file if what follows fails. Nothing for standard output.
void keep_document(const std::string& path, const nlohmann::json& so_far);
// Says that an output was written, if it is a file.
void print_written(const std::string& path);

}  // namespace cutproof::cli
