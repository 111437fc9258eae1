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

// This class ends frames: the plugin need not count them, compact numbers or clear lists of removals. The plugin's
// process begins with the backend. Throws the exceptions of Guest, and InputError for a plugin without stages. Loading
// throws Refused where the plugin refuses; running throws std::runtime_error with the plugin's fault.
std::unique_ptr<Backend> make_plugin_backend(const std::string& name);

}  // namespace cutproof::guests
