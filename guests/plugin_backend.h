// A plugin with stages as a backend: whatever judges backends judges it.
#pragma once
#include <memory>
#include <string>

#include "guests/guest.h"
#include "model/backend.h"

namespace cutproof::guests {

// "plugin:FILE.so" or "plugin:FILE.so,PARAMETERS", by which backends are named.
inline constexpr const char* kPluginPrefix = "plugin:";
GuestOptions options_of_name(const std::string& name);

// Frames end here: the plugin need neither count them nor compact numbers, nor empty what was removed in the last one.
// Its process begins with the backend. Throws what Guest throws, and InputError for a plugin without stages; loading
// throws Refused where the plugin refuses, and running std::runtime_error with what it did instead of answering.
std::unique_ptr<Backend> make_plugin_backend(const std::string& name);

}  // namespace cutproof::guests
