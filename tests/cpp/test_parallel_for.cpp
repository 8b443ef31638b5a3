#include "rayvox/parallel/parallel_for.hpp"

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include "check.hpp"
#include "rayvox/error.hpp"

using namespace rayvox;

FACT(every_index_is_visited_once_by_a_worker_of_its_own) {
  set_thread_count(4);
  for (const std::size_t count : {0u, 1u, 2u, 1000u}) {
    std::vector<std::atomic<int>> visits(count);
    std::atomic<int> busy[4] = {};
    parallel_for(count, [&](std::size_t index, int worker) {
      CHECK(worker >= 0 && worker < 4);
      CHECK_EQUAL(busy[worker].fetch_add(1), 0);
      ++visits[index];
      busy[worker].fetch_sub(1);
    });
    for (const auto& visit : visits) CHECK_EQUAL(visit.load(), 1);
  }
}

FACT(an_exception_reaches_the_caller_and_the_pool_goes_on) {
  set_thread_count(4);
  for (int round = 0; round < 50; ++round) {
    CHECK_THROWS(std::runtime_error, parallel_for(100, [](std::size_t index, int) {
                   if (index == 37) throw std::runtime_error("37");
                 }));
  }
}

FACT(callers_in_several_threads_do_not_disturb_each_other) {
  set_thread_count(3);
  std::vector<std::thread> callers;
  std::atomic<long> sum{0};
  for (int caller = 0; caller < 6; ++caller) {
    callers.emplace_back([&] {
      for (int round = 0; round < 200; ++round) {
        parallel_for(10, [&](std::size_t index, int) { sum += static_cast<long>(index); });
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  CHECK_EQUAL(sum.load(), 6L * 200 * 45);
}

FACT(thread_counts_out_of_range_are_refused) {
  CHECK_THROWS(InvalidInput, set_thread_count(0));
  CHECK_THROWS(InvalidInput, set_thread_count(257));
}

FACT(a_thread_may_leave_some_to_others_which_is_its_own_affair) {
  set_thread_count(4);
  std::thread([] {
    spare_threads(1);
    CHECK_EQUAL(thread_count(), 3);
    std::atomic<int> most_worker{0}, visits{0};
    parallel_for(1000, [&](std::size_t, int worker) {
      ++visits;
      for (int seen = most_worker; worker > seen && !most_worker.compare_exchange_weak(seen, worker);) {
      }
    });
    CHECK_EQUAL(visits.load(), 1000);
    CHECK(most_worker.load() < 3);
    spare_threads(9);
    CHECK_EQUAL(thread_count(), 1);
    spare_threads(-1);
    CHECK_EQUAL(thread_count(), 4);
  }).join();
  CHECK_EQUAL(thread_count(), 4);
}
