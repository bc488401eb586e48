/* Integrate: follows a sequence of paths. Each is planned from its targets, cut at the friction limit, and integrated by a move, a
 * ramp or pieces of both; rows are recorded between its ends. Row writers: worker threads project finished states while the main
 * thread integrates the next part. */

#include "integrate.h"
#include "drive.h"
#include "line.h"
#include "readout.h"

void hs_path_end(const hs_line *memory, const hs_path *path, double compliance, double request, double *d,
                    double *load, hs_target *target) {
    if (path->normal_control == HS_LOAD) {
        *load = hs_toward(memory->normal_load, path->normal_target, path->normal_fraction);
        *d = hs_approach_at_load(memory, *load);
    } else {
        *d = hs_toward(memory->approach, path->normal_target, path->normal_fraction);
        *load = *d == memory->approach ? memory->normal_load : hs_load_at(hs_all_of(memory->contact), *d).load;
    }
    if (path->tangential_control[0] == HS_LOAD) {
        *target = hs_to_load(hs_toward(request, path->tangential_target[0], path->tangential_fraction[0]));
    } else {
        double present = memory->displacement + compliance * memory->tangential_load;
        target->value = hs_toward(present, path->tangential_target[0], path->tangential_fraction[0]);
        target->rigid = 1.0;
        target->compliance = compliance;
    }
}

int hs_plan_path(hs_line *memory, const hs_path *path, double compliance, int saturate, int direct, hs_plan *plan,
               hs_refusal *refusal) {
    double force0 = memory->tangential_load + (saturate ? memory->excess : 0.0), d1, load;
    hs_path_end(memory, path, compliance, force0, &d1, &load, &plan->target);
    int by_force = plan->target.rigid == 0.0, both = path->normal_control == HS_LOAD && by_force;
    double touch = memory->contact->sorted_gap[0];
    const hs_request request = {both,
                                {both && load > 0.0 ? hs_most(memory->approach, touch) : memory->approach, d1},
                                {memory->normal_load, load},
                                {force0, plan->target.value}};
    plan->request = request;
    plan->times[0] = path->begin;
    plan->times[1] = path->end;
    plan->v[0] = memory->displacement;
    plan->v[1] = plan->target.value;
    plan->ends_separated = by_force && !both && d1 <= touch;
    plan->pieces.count = 0;
    if (by_force && hs_cut_at_limit(memory, &request, saturate, &plan->pieces, refusal) != HS_OK) return HS_BEYOND_LIMIT;
    return plan->target.compliance > 0.0 && !(both || plan->pieces.count || direct)
               ? hs_solve_displacement(memory, d1, load, plan->target, &plan->v[1])
               : (int)HS_OK;
}

int hs_integrate_part(hs_line *memory, const hs_plan *plan, double before, double share, const hs_drive *drive) {
    const hs_request *request = &plan->request;
    double time = hs_toward(plan->times[0], plan->times[1], share);
    int side = 0, status;
    if (plan->pieces.count) {
        status = hs_follow_limit(memory, request, &plan->pieces, before, share, plan->times, drive, &side);
    } else if (request->both_loads) {
        status = hs_ramp(memory, hs_toward(request->load[0], request->load[1], share),
                         hs_toward(request->force[0], request->force[1], share), time, drive);
    } else {
        double d = hs_toward(request->d[0], request->d[1], share);
        double load = d == request->d[1] ? request->load[1] : hs_load_at(hs_all_of(memory->contact), d).load;
        hs_target target = hs_to_displacement(hs_toward(plan->v[0], plan->v[1], share));
        /* what has left the contact on the way says no more where it was to go */
        if (share == 1.0 && !(plan->ends_separated && before > 0.0)) target = plan->target;
        hs_tick(memory, time);
        status = hs_move(memory, d, load, target);
        if (status == HS_OK && plan->ends_separated && share == 1.0) memory->tangential_load = plan->target.value;
    }
    if (status != HS_OK) return status;
    memory->excess = 0.0;
    if (side != 0) {
        /* what a load at the limit asks for beyond it, if that is more than rounding */
        double excess = hs_toward(request->force[0], request->force[1], share) - memory->tangential_load;
        if (fabs(excess) > HS_LIMIT_SLACK * fabs(memory->tangential_load)) memory->excess = excess;
    }
    return HS_OK;
}

/* A load or approach that is too small for a float would press on springs without any stiffness. */
static double scaled(double target, double unit, double least) {
    double found = target / unit;
    return fabs(found) < least ? 0.0 : found;
}

hs_path hs_scale_path(const hs_units *units, const hs_path *path) {
    hs_path found = *path;
    int by_load = path->normal_control == HS_LOAD;
    found.normal_target = scaled(path->normal_target, by_load ? units->load : units->length,
                                 by_load ? HS_LEAST_LOAD : HS_LEAST_APPROACH);
    found.tangential_target[0] /= path->tangential_control[0] == HS_LOAD ? units->load : units->displacement;
    return found;
}

int hs_line_step(hs_line *memory, int normal_control, double normal_target, int tangential_control,
                 double tangential_target, const hs_drive *drive, hs_refusal *refusal) {
    const hs_units *units = &memory->contact->units;
    /* NaN holds a channel as it was controlled last */
    int presses = !isnan(normal_target), moves = !isnan(tangential_target);
    hs_path path = {presses ? normal_target : 0.0, (double)presses, {moves ? tangential_target : 0.0, 0.0}, {(double)moves, 0.0},
                    1, 0, presses ? normal_control : memory->normal_control,
                    {moves ? tangential_control : memory->tangential_control, HS_HELD}, 1, NAN, NAN};
    hs_plan plan;
    hs_refusal unread;
    if (!refusal) refusal = &unread;
    refusal->path = 0;
    path = hs_scale_path(units, &path);
    hs_set_clock(memory, NAN);
    int status = hs_plan_path(memory, &path, drive->compliance[0] * units->stiffness, drive->saturate, 1, &plan, refusal);
    if (status == HS_OK) status = hs_integrate_part(memory, &plan, 0.0, 1.0, drive);
    refusal->status = status;
    if (status != HS_OK) return status;
    memory->normal_control = path.normal_control;
    memory->tangential_control = path.tangential_control[0];
    return HS_OK;
}

/* Threads that write rows while the next ones are walked.
 *
 * The walk itself is one thread: each step goes on from the one before. It hands on copies of the memory, rows do not
 * depend on one another, and no sum runs over more than one of them; so the bits are the same whatever the number of
 * threads. Where all threads are busy, the walk writes a row itself. */
typedef struct row_writers row_writers;

#if defined(_WIN32) || defined(HS_ONE_THREAD)

static row_writers *start_writers(int threads, const hs_line *memory, const hs_rows *rows) {
    return (void)threads, (void)memory, (void)rows, (row_writers *)NULL;
}
static int hand_over(row_writers *writers, const hs_line *memory, int64_t row, int saturated) {
    return (void)writers, (void)memory, (void)row, (void)saturated, 0;
}
static int end_writers(row_writers *writers) { return (void)writers, (int)HS_OK; }

#else

#include <pthread.h>

#define MOST_THREADS 64
/* rows that may wait for each thread */
#define WAITING 2

enum { FREE, FILLED, TAKEN };
/* A memory as it was at a row. */
typedef struct copy_of_row {
    hs_line *memory;
    int64_t row;
    int saturated;
    int state;
} copy_of_row;

struct row_writers {
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

static copy_of_row *first_in(row_writers *writers, int state) {
    for (int i = 0; i < writers->count; ++i)
        if (writers->copies[i].state == state) return writers->copies + i;
    return NULL;
}

static void *write_rows(void *argument) {
    row_writers *writers = (row_writers *)argument;
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

static int end_writers(row_writers *writers) {
    if (!writers) return HS_OK;
    pthread_mutex_lock(&writers->lock);
    writers->ends = 1;
    pthread_cond_broadcast(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    for (int i = 0; i < writers->threads; ++i) pthread_join(writers->thread[i], NULL);
    int status = writers->status;
    for (int i = 0; i < writers->count; ++i) hs_line_free(writers->copies[i].memory);
    pthread_cond_destroy(&writers->changed);
    pthread_mutex_destroy(&writers->lock);
    free(writers);
    return status;
}

static row_writers *start_writers(int threads, const hs_line *memory, const hs_rows *rows) {
    if (threads < 2) return NULL;
    row_writers *writers = (row_writers *)calloc(1, sizeof *writers);
    if (!writers) return NULL;
    writers->rows = rows;
    writers->contact = memory->contact;
    if (threads - 1 > MOST_THREADS) threads = MOST_THREADS + 1;
    pthread_mutex_init(&writers->lock, NULL);
    pthread_cond_init(&writers->changed, NULL);
    while (writers->count < WAITING * (threads - 1)) {
        hs_line *copy = hs_line_copy(memory);
        if (!copy) break;
        writers->copies[writers->count++].memory = copy;
    }
    while (writers->count && writers->threads < threads - 1) {
        if (pthread_create(writers->thread + writers->threads, NULL, write_rows, writers) != 0) break;
        ++writers->threads;
    }
    if (writers->threads) return writers;
    end_writers(writers);
    return NULL;
}

static int hand_over(row_writers *writers, const hs_line *memory, int64_t row, int saturated) {
    pthread_mutex_lock(&writers->lock);
    copy_of_row *free_one = first_in(writers, FREE);
    if (free_one) free_one->state = TAKEN;
    pthread_mutex_unlock(&writers->lock);
    if (!free_one) return 0;
    int copied = hs_line_assign(free_one->memory, memory) == HS_OK;
    free_one->row = row;
    free_one->saturated = saturated;
    pthread_mutex_lock(&writers->lock);
    free_one->state = copied ? FILLED : FREE;
    pthread_cond_signal(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    return copied;
}

#endif

/* numbers of paths times recorded asperities from which threads are worth their start */
#define HS_LEAST_SHARED (1 << 19)

int hs_line_integrate(hs_line *memory, const hs_path *paths, int64_t count, const hs_rows *rows, const hs_drive *drive,
                      double until, hs_refusal *refusal) {
    const hs_units *units = &memory->contact->units;
    double compliance = drive->compliance[0] * units->stiffness;
    hs_recorder recorder;
    hs_plan plan;
    hs_refusal unread;
    int flag = 0;
    if (!refusal) refusal = &unread;
    int64_t work = 0, each = 1 + (memory->contact->count + (rows ? rows->columns : 0)) / 16;
    int status = hs_begin_recording(&recorder, memory->contact, rows);
    if (status != HS_OK) return status;
    row_writers *writers = count * (rows ? rows->columns : 0) < HS_LEAST_SHARED
                              ? NULL
                              : start_writers(drive->threads, memory, rows);
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        hs_path path = hs_scale_path(units, paths + p);
        double before = 0.0;
        refusal->path = p;
        hs_set_clock(memory, path.begin);
        status = hs_plan_path(memory, &path, compliance, drive->saturate, path.parts == 1 && until == 1.0, &plan, refusal);
        for (int64_t part = 1; part <= path.parts && status == HS_OK; ++part) {
            double share = until * ((double)part / (double)path.parts);
            status = hs_integrate_part(memory, &plan, before, share, drive);
            before = share;
            if (status == HS_OK) status = hs_count_work(drive, &work, each);
            if (status == HS_OK && memory->lost_slides) status = HS_OUT_OF_MEMORY;
            if (status != HS_OK) break;
            /* several paths may lead to one row */
            flag |= memory->excess != 0.0;
            if (rows && (part < path.parts || path.recorded)) {
                int64_t row = path.first_row + part - 1;
                if (!(writers && hand_over(writers, memory, row, flag)))
                    status = hs_record(&recorder, memory, row, flag);
                flag = 0;
            }
        }
        memory->normal_control = path.normal_control;
        memory->tangential_control = path.tangential_control[0];
    }
    int written = end_writers(writers);
    if (status == HS_OK) status = written;
    hs_end_recording(&recorder);
    refusal->status = status;
    return status;
}
