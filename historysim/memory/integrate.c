/* Integrate: integrates a sequence of paths. Each is planned from its targets, cut at the friction
 * limit, and integrated by moves (straight in d, V) and ramps (straight in N, T); rows are recorded
 * at equal path fractions. Row writers: worker threads write rows while the main thread integrates.
 */

#include "integrate.h"
#include "drive.h"
#include "line.h"
#include "readout.h"

void hs_path_targets(const hs_line *memory, const hs_path *path, double compliance, double request,
                     double *d, double *load, hs_target *target) {
    if (path->normal_control == HS_LOAD) {
        *load = hs_toward(memory->normal_load, path->normal_target, path->normal_fraction);
        *d = hs_approach_at_load(memory, *load);
    } else {
        *d = hs_toward(memory->approach, path->normal_target, path->normal_fraction);
        *load = *d == memory->approach ? memory->normal_load
                                       : hs_load_at(hs_all_of(memory->contact), *d).load;
    }
    if (path->tangential_control[0] == HS_LOAD) {
        *target = hs_to_load(
            hs_toward(request, path->tangential_target[0], path->tangential_fraction[0]));
    } else {
        double present = memory->displacement + compliance * memory->tangential_load;
        target->value =
            hs_toward(present, path->tangential_target[0], path->tangential_fraction[0]);
        target->rigid = 1.0;
        target->compliance = compliance;
    }
}

int hs_plan_path(hs_line *memory, const hs_path *path, double compliance, int saturate, int direct,
                 hs_plan *plan, hs_refusal *refusal) {
    double force0 = memory->tangential_load + (saturate ? memory->excess : 0.0), d1, load;
    hs_path_targets(memory, path, compliance, force0, &d1, &load, &plan->target);
    int by_force = plan->target.rigid == 0.0, both = path->normal_control == HS_LOAD && by_force;
    double touch = memory->contact->sorted_gap[0];
    const hs_request request = {
        both,
        {both && load > 0.0 ? hs_max(memory->approach, touch) : memory->approach, d1},
        {memory->normal_load, load},
        {force0, plan->target.value}};
    plan->request = request;
    plan->times[0] = path->begin;
    plan->times[1] = path->end;
    plan->v[0] = memory->displacement;
    plan->v[1] = plan->target.value;
    plan->ends_separated = by_force && !both && d1 <= touch;
    plan->pieces.count = 0;
    if (by_force && hs_cut_at_limit(memory, &request, saturate, &plan->pieces, refusal) != HS_OK)
        return HS_BEYOND_LIMIT;
    return plan->target.compliance > 0.0 && !(both || plan->pieces.count || direct)
               ? hs_solve_displacement(memory, d1, load, plan->target, &plan->v[1])
               : (int)HS_OK;
}

int hs_follow_plan(hs_line *memory, const hs_plan *plan, double from, double to,
                   const hs_drive *drive) {
    const hs_request *request = &plan->request;
    double time = hs_toward(plan->times[0], plan->times[1], to);
    int side = 0, status;
    if (plan->pieces.count) {
        status =
            hs_follow_limit(memory, request, &plan->pieces, from, to, plan->times, drive, &side);
    } else if (request->both_loads) {
        status = hs_ramp(memory, hs_toward(request->load[0], request->load[1], to),
                         hs_toward(request->force[0], request->force[1], to), time, drive);
    } else {
        double d = hs_toward(request->d[0], request->d[1], to);
        double load =
            d == request->d[1] ? request->load[1] : hs_load_at(hs_all_of(memory->contact), d).load;
        hs_target target = hs_to_displacement(hs_toward(plan->v[0], plan->v[1], to));
        /* a tangential load that ends on a separated contact is no target after the first row: the
         * path stays straight in V */
        if (to == 1.0 && !(plan->ends_separated && from > 0.0)) target = plan->target;
        hs_tick(memory, time);
        status = hs_move(memory, d, load, target);
        if (status == HS_OK && plan->ends_separated && to == 1.0)
            memory->tangential_load = plan->target.value;
    }
    if (status != HS_OK) return status;
    memory->excess = 0.0;
    if (side != 0) {
        /* excess of the request over the friction limit, unless it is rounding */
        double excess =
            hs_toward(request->force[0], request->force[1], to) - memory->tangential_load;
        if (fabs(excess) > HS_LIMIT_SLACK * fabs(memory->tangential_load)) memory->excess = excess;
    }
    return HS_OK;
}

/* Scale a target by a unit; magnitudes below `smallest` are 0, because the stiffness of so small a
 * contact rounds to 0. */
static double scale_target(double target, double unit, double smallest) {
    double result = target / unit;
    return fabs(result) < smallest ? 0.0 : result;
}

hs_path hs_scale_path(const hs_units *units, const hs_path *path) {
    hs_path scaled = *path;
    int by_load = path->normal_control == HS_LOAD;
    scaled.normal_target = scale_target(path->normal_target, by_load ? units->load : units->length,
                                        by_load ? HS_MIN_LOAD : HS_MIN_APPROACH);
    scaled.tangential_target[0] /=
        path->tangential_control[0] == HS_LOAD ? units->load : units->displacement;
    return scaled;
}

int hs_line_step(hs_line *memory, int normal_control, double normal_target, int tangential_control,
                 double tangential_target, const hs_drive *drive, hs_refusal *refusal) {
    const hs_units *units = &memory->contact->units;
    /* NaN keeps the previous control of a channel */
    int presses = !isnan(normal_target), moves = !isnan(tangential_target);
    hs_path path = {presses ? normal_target : 0.0,
                    (double)presses,
                    {moves ? tangential_target : 0.0, 0.0},
                    {(double)moves, 0.0},
                    1,
                    0,
                    presses ? normal_control : memory->normal_control,
                    {moves ? tangential_control : memory->tangential_control, HS_HELD},
                    1,
                    NAN,
                    NAN};
    hs_plan plan;
    hs_refusal unread;
    if (!refusal) refusal = &unread;
    refusal->path = 0;
    path = hs_scale_path(units, &path);
    hs_set_clock(memory, NAN);
    int status = hs_plan_path(memory, &path, drive->compliance[0] * units->stiffness,
                              drive->saturate, 1, &plan, refusal);
    if (status == HS_OK) status = hs_follow_plan(memory, &plan, 0.0, 1.0, drive);
    refusal->status = status;
    if (status != HS_OK) return status;
    memory->normal_control = path.normal_control;
    memory->tangential_control = path.tangential_control[0];
    return HS_OK;
}

/* Threads that write rows during the integration.
 *
 * The integration is sequential, in one thread, which passes copies of the memory to writers. Rows
 * are independent, and no sum runs over several rows, so the bits do not depend on the number of
 * threads. If all writers are busy, the main thread writes the row. */
typedef struct row_writers row_writers;

#if defined(_WIN32) || defined(HS_ONE_THREAD)

static row_writers *start_writers(int threads, const hs_line *memory, const hs_rows *rows) {
    return (void)threads, (void)memory, (void)rows, (row_writers *)NULL;
}
static int pass_to_writer(row_writers *writers, const hs_line *memory, int64_t row, int saturated) {
    return (void)writers, (void)memory, (void)row, (void)saturated, 0;
}
static int stop_writers(row_writers *writers) { return (void)writers, (int)HS_OK; }

#else

#include <pthread.h>

/* Writer threads, at most; chosen. */
#define MAX_THREADS 64
/* Copies of rows for each thread, so that one may wait while one is written; chosen. */
#define WAITING 2

enum { FREE, FILLED, TAKEN };
/* Copy of a memory at a row. */
typedef struct copy_of_row {
    hs_line *memory;
    int64_t row;
    int saturated;
    int state;
} copy_of_row;

struct row_writers {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    pthread_t thread[MAX_THREADS];
    copy_of_row copies[WAITING * MAX_THREADS];
    const hs_rows *rows;
    hs_contact *contact;
    int threads;
    int count;  /* of copies */
    int ends;   /* true if no more rows follow */
    int status; /* error of a thread, else HS_OK */
};

static copy_of_row *find_copy(row_writers *writers, int state) {
    for (int i = 0; i < writers->count; ++i)
        if (writers->copies[i].state == state) return writers->copies + i;
    return NULL;
}

static void *write_rows(void *argument) {
    row_writers *writers = (row_writers *)argument;
    hs_recorder recorder;
    int status = hs_recorder_init(&recorder, writers->contact, writers->rows);
    pthread_mutex_lock(&writers->lock);
    for (;;) {
        copy_of_row *copy = find_copy(writers, FILLED);
        if (!copy && writers->ends) break;
        if (!copy) {
            pthread_cond_wait(&writers->changed, &writers->lock);
            continue;
        }
        copy->state = TAKEN;
        pthread_mutex_unlock(&writers->lock);
        if (status == HS_OK)
            status = hs_record(&recorder, copy->memory, copy->row, copy->saturated);
        pthread_mutex_lock(&writers->lock);
        copy->state = FREE;
        if (status != HS_OK) writers->status = status;
    }
    pthread_mutex_unlock(&writers->lock);
    hs_recorder_clear(&recorder);
    return NULL;
}

static int stop_writers(row_writers *writers) {
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
    if (threads - 1 > MAX_THREADS) threads = MAX_THREADS + 1;
    pthread_mutex_init(&writers->lock, NULL);
    pthread_cond_init(&writers->changed, NULL);
    while (writers->count < WAITING * (threads - 1)) {
        hs_line *copy = hs_line_copy(memory);
        if (!copy) break;
        writers->copies[writers->count++].memory = copy;
    }
    while (writers->count && writers->threads < threads - 1) {
        if (pthread_create(writers->thread + writers->threads, NULL, write_rows, writers) != 0)
            break;
        ++writers->threads;
    }
    if (writers->threads) return writers;
    stop_writers(writers);
    return NULL;
}

static int pass_to_writer(row_writers *writers, const hs_line *memory, int64_t row, int saturated) {
    pthread_mutex_lock(&writers->lock);
    copy_of_row *copy = find_copy(writers, FREE);
    if (copy) copy->state = TAKEN;
    pthread_mutex_unlock(&writers->lock);
    if (!copy) return 0;
    int copied = hs_line_assign(copy->memory, memory) == HS_OK;
    copy->row = row;
    copy->saturated = saturated;
    pthread_mutex_lock(&writers->lock);
    copy->state = copied ? FILLED : FREE;
    pthread_cond_signal(&writers->changed);
    pthread_mutex_unlock(&writers->lock);
    return copied;
}

#endif

/* Product of paths and recorded asperities from which threads are faster in spite of their start;
 * chosen. */
#define MIN_SHARED_WORK (1 << 19)

int hs_line_integrate(hs_line *memory, const hs_path *paths, int64_t count, const hs_rows *rows,
                      const hs_drive *drive, double until, hs_refusal *refusal) {
    const hs_units *units = &memory->contact->units;
    double compliance = drive->compliance[0] * units->stiffness;
    hs_recorder recorder;
    hs_plan plan;
    hs_refusal unread;
    int flag = 0;
    if (!refusal) refusal = &unread;
    int64_t work = 0, work_per_row = 1 + (memory->contact->count + (rows ? rows->columns : 0)) / 16;
    int status = hs_recorder_init(&recorder, memory->contact, rows);
    if (status != HS_OK) return status;
    row_writers *writers = count * (rows ? rows->columns : 0) < MIN_SHARED_WORK
                               ? NULL
                               : start_writers(drive->threads, memory, rows);
    for (int64_t p = 0; p < count && status == HS_OK; ++p) {
        hs_path path = hs_scale_path(units, paths + p);
        double previous_fraction = 0.0;
        refusal->path = p;
        hs_set_clock(memory, path.begin);
        status = hs_plan_path(memory, &path, compliance, drive->saturate,
                              path.parts == 1 && until == 1.0, &plan, refusal);
        for (int64_t division = 1; division <= path.parts && status == HS_OK; ++division) {
            double fraction = until * ((double)division / (double)path.parts);
            status = hs_follow_plan(memory, &plan, previous_fraction, fraction, drive);
            previous_fraction = fraction;
            if (status == HS_OK) status = hs_count_work(drive, &work, work_per_row);
            if (status == HS_OK && memory->lost_slides) status = HS_OUT_OF_MEMORY;
            if (status != HS_OK) break;
            /* several paths may share one row */
            flag |= memory->excess != 0.0;
            if (rows && (division < path.parts || path.recorded)) {
                int64_t row = path.first_row + division - 1;
                if (!(writers && pass_to_writer(writers, memory, row, flag)))
                    status = hs_record(&recorder, memory, row, flag);
                flag = 0;
            }
        }
        memory->normal_control = path.normal_control;
        memory->tangential_control = path.tangential_control[0];
    }
    int written = stop_writers(writers);
    if (status == HS_OK) status = written;
    hs_recorder_clear(&recorder);
    refusal->status = status;
    return status;
}
