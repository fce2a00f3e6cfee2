// [[nodiscard]] with its reason, which C++17 does not know.
#pragma once

#if __cplusplus >= 202002L
#define SWARMTALK_NODISCARD(reason) [[nodiscard(reason)]]
#else
#define SWARMTALK_NODISCARD(reason) [[nodiscard]]
#endif
