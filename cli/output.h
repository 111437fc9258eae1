// What the program writes: standard output, and documents.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace cutproof::cli {

// Hands what was printed to the system. Throws MachineError if it, or anything before it, cannot be written; but not
// where nobody reads it any more: that asks to stop (interruption.h).
void flush_output();

// With what the output of every suite and of `tune` begins, of the head of its document (io::filled).
inline constexpr const char* kHead = "{backend} on {device}, {date}\n";

// Nothing if `path` is empty, else a failure now rather than after the measurements: throws InputError if the folder is
// not there or not writable.
void require_writable(const std::string& path);
// Makes a folder that is not there. Throws InputError, naming the option, if that cannot be done or it is not writable.
void make_folder(const std::string& option, const std::string& path);
// The whole document or nothing; nothing if `path` is empty.
void write_document(const std::string& path, const nlohmann::json& document);

}  // namespace cutproof::cli
