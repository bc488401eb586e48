/* Threads that write rows while the next ones are walked.
 *
 * The walk itself is one thread: each step goes on from the one before. It hands on copies of the memory, rows do not
 * depend on one another, and no sum runs over more than one of them; so the bits are the same whatever the number of
 * threads. Where all threads are busy, the walk writes a row itself. */

#include "internal.h"

#if defined(_WIN32) || defined(HS_ONE_THREAD)

hs_writers *hs_start_writers(int threads, const hs_memory *memory, const hs_rows *rows) {
    return (void)threads, (void)memory, (void)rows, (hs_writers *)NULL;
}
int hs_hand_over(hs_writers *writers, const hs_memory *memory, int64_t row, int saturated) {
    return (void)writers, (void)memory, (void)row, (void)saturated, 0;
}
int hs_end_writers(hs_writers *writers) { return (void)writers, (int)HS_OK; }

#else

#include <pthread.h>

#define MOST_THREADS 64
/* rows that may wait for each thread */
#define WAITING 2

enum { FREE, FILLED, TAKEN };
/* A memory as it was at a row. */
typedef struct copy_of_row {
    hs_memory *memory;
    int64_t row;
    int saturated;
    int state;
} copy_of_row;

struct hs_writers {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    pthread_t thread[MOST_THREADS];
    copy_of_row copies[WAITING * MOST_THREADS];
    const hs_rows *rows;
    hs_contact *contact;
    int threads;
    int count;  /* of copies */
    int ends;   /* whether no more rows come */
    int status; /* of what went wrong in a thread */
};

static copy_of_row *first_in(hs_writers *writers, int state) {
    for (int i = 0; i < writers->count; ++i)
        if (writers->copies[i].state == state) return writers->copies + i;
    return NULL;
}

static void *write_rows(void *argument) {
    hs_writers *writers = (hs_writers *)argument;
    hs_recorder recorder;
    int status = hs_begin_recording(&recorder, writers->contact, writers->rows);
    pthread_mutex_lock(&writers->lock);
    for (;;) {
        copy_of_row *next = first_in(writers, FILLED);
        if (!next && writers->ends) break;
        if (!next) {
            pthread_cond_wait(&writers->changed, &writers->lock);
            continue;
        }
        next->state = TAKEN;
        pthread_mutex_unlock(&writers->lock);
        if (status == HS_OK) status = hs_record(&recorder, next->memory, next->row, next->saturated);
        pthread_mutex_lock(&writers->lock);
        next->state = FREE;
        if (status != HS_OK) writers->status = status;
    }
    pthread_mutex_unlock(&writers->lock);
    hs_end_recording(&recorder);
    return NULL;
}

hs_writers *hs_start_writers(int threads, const hs_memory *memory, const hs_rows *rows) {
    if (threads < 2) return NULL;
    hs_writers *writers = (hs_writers *)calloc(1, sizeof *writers);
    if (!writers) return NULL;
    writers->rows = rows;
    writers->contact = memory->contact;
    if (threads - 1 > MOST_THREADS) threads = MOST_THREADS + 1;
    pthread_mutex_init(&writers->lock, NULL);
    pthread_cond_init(&writers->changed, NULL);
    while (writers->count < WAITING * (threads - 1)) {
        hs_memory *copy = hs_memory_copy(memory);
        if (!copy) break;
        writers->copies[writers->count++].memory = copy;
    }
    while (writers->count && writers->threads < threads - 1) {
        if (pthread_create(writers->thread + writers->threads, NULL, write_rows, writers) != 0) break;
        ++writers->threads;
    }
    if (writers->threads) return writers;
    hs_end_writers(writers);
    return NULL;
}

int hs_hand_over(hs_writers *writers, const hs_memory *memory, int64_t row, int saturated) {
    pthread_mutex_lock(&writers->lock);
    copy_of_row *free_one = first_in(writers, FREE);
    if (free_one) free_one->state = TAKEN;
    pthread_mutex_unlock(&writers->lock);
    if (!free_one) return 0;
    int copied = hs_memory_assign(free_one->memory, memory) == HS_OK;
    free_one->row = row;
    free_one->saturated = saturated;
    pthread_mutex_lock(&writers->lock);
    free_one->state = copied ? FILLED : FREE;
    pthread_cond_signal(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    return copied;
}

int hs_end_writers(hs_writers *writers) {
    if (!writers) return HS_OK;
    pthread_mutex_lock(&writers->lock);
    writers->ends = 1;
    pthread_cond_broadcast(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    for (int i = 0; i < writers->threads; ++i) pthread_join(writers->thread[i], NULL);
    int status = writers->status;
    for (int i = 0; i < writers->count; ++i) hs_memory_free(writers->copies[i].memory);
    pthread_cond_destroy(&writers->changed);
    pthread_mutex_destroy(&writers->lock);
    free(writers);
    return status;
}

#endif
