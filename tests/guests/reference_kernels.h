// What a plugin of the reference calls, compiled once for each precision (PLUGIN_REAL).
#pragma once

#include <cutproof/plugin.h>

namespace reference_plugin {

void* create(const cutproof_host*, const char* parameters);
void destroy(void* self);
int load(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_state*);
int run(const cutproof_host* host, void* self, int first, int last, cutproof_state* given);
int rotations(const cutproof_host*, void* self, const cutproof_array* a, const cutproof_array* previous,
              cutproof_array* r);
int surface(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_array* alive,
            cutproof_array* vertices, cutproof_array* triangles);

}  // namespace reference_plugin
