#pragma once
#include <cstddef>
#include <functional>

namespace rayvox {

/// Most threads a parallel_for of the calling thread uses: set_thread_count's value, else the environment variable
/// RAYVOX_THREADS, else the number of processors; less those it spares.
int thread_count();
/// Throws InvalidInput unless 1 <= count <= 256.
void set_thread_count(int count);

/// From now on the calling thread's parallel_for leaves so many of these threads to others, but works itself. For
/// steady work beside short work that somebody waits for.
void spare_threads(int count);

/// Calls body(index, worker) for every index below `count`, in parallel, the calling thread taking part; returns when
/// all are done. Indices are taken in ascending order; worker < workers is unique among the threads running at the same
/// time. The first exception a body throws is rethrown here after the others have finished.
void parallel_for(std::size_t count, int workers, const std::function<void(std::size_t index, int worker)>& body);

/// With thread_count() workers.
void parallel_for(std::size_t count, const std::function<void(std::size_t index, int worker)>& body);

}  // namespace rayvox
