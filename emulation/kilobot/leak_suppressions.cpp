// avr_terminate() of simavr 1.6 does not give back everything that avr_init() has taken; a build
// with the address sanitizer must not blame us for it.
#if defined(__SANITIZE_ADDRESS__)
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libsimavr";
}
#endif
