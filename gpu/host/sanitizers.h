// Which sanitizers this is compiled for: CUTPROOF_ASAN, CUTPROOF_TSAN.
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#define CUTPROOF_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define CUTPROOF_ASAN 1
#endif
#endif
#if defined(__SANITIZE_THREAD__)
#define CUTPROOF_TSAN 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define CUTPROOF_TSAN 1
#endif
#endif
#ifdef CUTPROOF_ASAN
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#endif
#ifdef CUTPROOF_TSAN
#include <sanitizer/tsan_interface.h>
#endif
