/* HS_API marks what the library shows of itself; all else is hidden. */
#ifndef HS_API
#if defined(_WIN32)
#define HS_API __declspec(dllexport)
#else
#define HS_API __attribute__((visibility("default")))
#endif
#endif
