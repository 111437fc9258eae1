/* Stands in for libcuda.so.1: memory of the host as "device", for the test of what cutproof.py makes of the driver on
 * machines without one. It counts what is allocated, finds what lies outside of that, and fails where a real driver
 * would: so many of its functions as cutproof.py and its test call. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef int Result;
typedef unsigned long long Pointer;
enum { kFine = 0, kInvalidValue = 1, kNoDevice = 100, kInvalidContext = 201, kIllegalAddress = 700, kMost = 4096 };

static struct {
  unsigned char* begin;
  size_t size;
} blocks[kMost];
static int count = 0;
static void* current = NULL;
static int broken = 0;
static int context;

static int lies_in_a_block(Pointer pointer, size_t size) {
  for (int k = 0; k < kMost; ++k) {
    const Pointer begin = (Pointer)(size_t)blocks[k].begin;
    if (blocks[k].begin != NULL && pointer >= begin && pointer + size <= begin + blocks[k].size) return 1;
  }
  return 0;
}
static Result check(Pointer pointer, size_t size) {
  if (broken) return kIllegalAddress;
  if (current == NULL) return kInvalidContext;
  return lies_in_a_block(pointer, size) ? kFine : kInvalidValue;
}
#define AT(pointer) ((unsigned char*)(size_t)(pointer))

Result cuInit(unsigned flags) { return broken ? kNoDevice : flags == 0 ? kFine : kInvalidValue; }
Result cuDeviceGet(int* device, int number) { return *device = 0, number == 0 ? kFine : kInvalidValue; }
Result cuDevicePrimaryCtxRetain(void** to, int device) { return *to = &context, device == 0 ? kFine : kInvalidValue; }
Result cuCtxSetCurrent(void* to) { return current = to, kFine; }
Result cuCtxSynchronize(void) { return broken ? kIllegalAddress : current != NULL ? kFine : kInvalidContext; }
Result cuMemAlloc_v2(Pointer* to, size_t size) {
  if (current == NULL) return kInvalidContext;
  for (int k = 0; k < kMost && size > 0; ++k) {
    if (blocks[k].begin != NULL) continue;
    blocks[k].begin = malloc(size);
    blocks[k].size = size;
    *to = (Pointer)(size_t)blocks[k].begin;
    ++count;
    return kFine;
  }
  return kInvalidValue;
}
Result cuMemFree_v2(Pointer pointer) {
  for (int k = 0; k < kMost; ++k) {
    if (blocks[k].begin == NULL || blocks[k].begin != AT(pointer)) continue;
    free(blocks[k].begin);
    blocks[k].begin = NULL;
    --count;
    return kFine;
  }
  return kInvalidValue;
}
Result cuMemcpyHtoD_v2(Pointer to, const void* from, size_t size) {
  const Result result = check(to, size);
  if (result == kFine) memcpy(AT(to), from, size);
  return result;
}
Result cuMemcpyDtoH_v2(void* to, Pointer from, size_t size) {
  const Result result = check(from, size);
  if (result == kFine) memcpy(to, AT(from), size);
  return result;
}
Result cuMemcpyDtoD_v2(Pointer to, Pointer from, size_t size) {
  const Result result = check(to, size) != kFine ? check(to, size) : check(from, size);
  if (result == kFine) memmove(AT(to), AT(from), size);
  return result;
}
Result cuMemsetD8_v2(Pointer to, unsigned char value, size_t size) {
  const Result result = check(to, size);
  if (result == kFine) memset(AT(to), value, size);
  return result;
}
Result cuGetErrorName(Result result, const char** name) {
  *name = result == kInvalidValue     ? "CUDA_ERROR_INVALID_VALUE"
          : result == kNoDevice       ? "CUDA_ERROR_NO_DEVICE"
          : result == kIllegalAddress ? "CUDA_ERROR_ILLEGAL_ADDRESS"
                                      : "CUDA_ERROR_INVALID_CONTEXT";
  return kFine;
}
/* Not of CUDA: for the test. A kernel that went astray leaves a context in which everything fails. */
void stand_in_break(int whether) { broken = whether; }
int stand_in_count(void) { return count; }
