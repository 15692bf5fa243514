// A Cortex-M3 in QEMU (mps2-an385): runs the recorded sequence and writes, through semihosting, the
// bits of the pose and the cost of each step. recording.inc is made by the test.
#include <cstdint>
#include <new>

#include "embedded_filter.hpp"

namespace {

const embedded::Record kRecords[] = {
#include "recording.inc"
};

int semihosting(int operation, const void* argument) {
  register int r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void write_hexadecimal(std::uint32_t value, char end) {
  char text[10];
  for (int i = 0; i < 8; ++i) text[i] = "0123456789abcdef"[(value >> (28 - 4 * i)) & 15];
  text[8] = end;
  text[9] = '\0';
  semihosting(0x04, text);  // SYS_WRITE0
}

std::uint32_t bits(float value) {
  std::uint32_t result;
  __builtin_memcpy(&result, &value, sizeof result);
  return result;
}

/// The system timer counts down from 2^24 - 1 at 25 MHz; with -icount shift=0 an instruction takes
/// one nanosecond, so that a tick is 40 instructions.
volatile std::uint32_t* const kTimer = reinterpret_cast<volatile std::uint32_t*>(0xE000E010);

alignas(8) unsigned char storage[sizeof(embedded::Filter)];

[[noreturn]] void stop() {
  semihosting(0x18, reinterpret_cast<const void*>(0x20026));  // SYS_EXIT
  for (;;) {
  }
}

}  // namespace

int main() {
  kTimer[1] = 0xFFFFFF;
  kTimer[2] = 0;
  kTimer[0] = 5;
  auto& filter = *new (storage) embedded::Filter(embedded::configuration());
  if (!embedded::start(filter, kRecords[0])) stop();
  for (const auto& record : kRecords) {
    const std::uint32_t before = kTimer[2];
    if (!embedded::step(filter, record)) stop();
    const std::uint32_t ticks = (before - kTimer[2]) & 0xFFFFFF;
    for (int i = 0; i < embedded::kPose; ++i) write_hexadecimal(bits(filter.state().robot[i]), ' ');
    write_hexadecimal(ticks, ' ');
    write_hexadecimal(static_cast<std::uint32_t>(filter.state().map.size()), '\n');
  }
  stop();
}

extern "C" {
extern std::uint32_t data_load, data_begin, data_end, bss_begin, bss_end, stack_top;

void reset() {
  std::uint32_t* from = &data_load;
  for (std::uint32_t* to = &data_begin; to < &data_end;) *to++ = *from++;
  for (std::uint32_t* to = &bss_begin; to < &bss_end;) *to++ = 0;
  main();
  stop();
}
void fault() { stop(); }

__attribute__((section(".vectors"), used)) void (*const vectors[])() = {
    reinterpret_cast<void (*)()>(&stack_top), reset, fault, fault, fault, fault, fault};
}
