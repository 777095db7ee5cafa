"""A classroom: the plan of a room into which one draws, and a robot in it that learns from that.

Everything is done with the mouse. Where a line is drawn on the floor, the person walks; an object
that is dragged is moved; a click carries the robot off. What the robot makes of it is drawn as it
goes, and said in words over the plan; what cannot be is said where it was tried, and changes
nothing.
"""

import asyncio
from html import escape
from io import BytesIO

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from dollop import plot
from dollop.replication.teaching import lesson as lessons
from dollop.replication.teaching.lesson import Lesson, Refused

__all__ = ["Classroom"]

GRASP = 0.15
"""m that a mouse moves before a click becomes a line."""
FRAMES, PERIODS = 45, 8
"""Pictures of a walk, about, and the robot's periods between two: more would only take longer."""
SIZE, PLAN, KNOWN = (10, 5.8), (0.05, 0.15, 0.64, 0.77), (0.69, 0.15, 0.3, 0.77)
"""Inches of the figure, and where the plan is and what the robot knows: they stay under the mouse."""
PAUSE = 0.02
"""s between two pictures, in which the mouse is heard."""
WARNING = "#B0003A"
INVITATION = "Draw a walk on the floor: press the mouse button, draw, let go."
TOOLS = {"put a can": "can", "put a cone": "cone", "take away": "take away"}
"""Buttons that say what the next click does."""


class Classroom:
    """The plan of a room to draw into with the mouse, and the lesson that comes of it.

    Parameters
    ----------
    background : OccupancyGrid
    scene : Scene, optional
        Two trash cans when not given.
    live : bool
        Show what happens as it happens; otherwise each event is followed to its end at once.

    Attributes
    ----------
    lesson : Lesson
        What has been shown and learned so far: the last that was good.
    run : Run or None
        The robot's last.
    said : str
        What stands over the plan.
    tool : str
        What the next click does: "", "can", "cone" or "take away".
    figure : matplotlib.figure.Figure
    """

    def __init__(self, background, scene=None, live=True):
        self._first = scene
        self.live, self.tool, self.run, self.said = live, "", None, INVITATION
        self._hearers, self._going, self._trail, self._carry = [], None, None, None
        self._drawn = self._held = None
        self.lesson = Lesson.begin(background, scene)
        plt.draw_if_interactive()  # begins the notebook's way of showing, which a style's end would undo
        self.figure = Figure(figsize=SIZE)
        self._plan, self._known = (self.figure.add_axes(each) for each in (PLAN, KNOWN))
        self._plan.set_anchor("NW")
        # What is not opaque is sent whole; of changes a browser that is late would lose some.
        self.figure.patch.set_alpha(0.99)
        self._still = None
        make = canvas_that_is_heard if live and running_loop() else FigureCanvasAgg
        canvas = make(self.figure)
        for event, heard in (
            ("button_press_event", self._press),
            ("motion_notify_event", self._move),
            ("button_release_event", self._release),
            ("draw_event", self._keep_still),
        ):
            canvas.mpl_connect(event, heard)
        self._draw()

    def _repr_png_(self):
        """The plan as a picture, which notebooks show."""
        with BytesIO() as stream:
            self.figure.savefig(stream, format="png")
            return stream.getvalue()

    def on_change(self, hear):
        """Have a function called whenever something is said.

        Parameters
        ----------
        hear : callable
            Takes this classroom.
        """
        self._hearers.append(hear)

    def desk(self):
        """Buttons for what the mouse alone cannot do, and in words what is going on.

        Returns
        -------
        ipywidgets.VBox
            To be shown above `figure.canvas`.
        """
        import ipywidgets

        said = ipywidgets.HTML()
        names = *TOOLS, "drive again", "start over"
        buttons = [ipywidgets.Button(description=each) for each in names]
        for button in buttons:
            button.on_click(lambda pressed: self._pressed_button(pressed.description))

        def hear(_):
            said.value = f'<p class="said" role="status" aria-live="polite">{escape(self.said)}</p>'

        self.on_change(hear)
        hear(self)
        return ipywidgets.VBox([ipywidgets.HBox(buttons), said])

    def _pressed_button(self, name):
        """What a button of the desk does."""
        if name in TOOLS:
            self.tool = TOOLS[name]
            self._say(f"Click where: {name}.")
        elif name == "drive again":
            self.drive()
        else:
            self.start_over()

    @property
    def busy(self):
        """Whether somebody walks or the robot drives."""
        return self._going is not None

    # ---- what one can do

    def show_walk(self, points):
        """Have the person walk along a line, the robot learn it, and drive it.

        Parameters
        ----------
        points : (N, 2) array_like
            In m.
        """
        self._begin(lambda: self._shown(self.lesson.walk(points)))

    def drag(self, k, place):
        """Move an object, have the robot adapt its task, and drive it.

        Parameters
        ----------
        k : int
            Which of the lesson's scene.
        place : (2,) sequence of float
            In m.
        """
        self._rearrange(lambda: self.lesson.moved(k, place), f"Object {k} has moved")

    def put(self, kind, place):
        """Put one object more into the room.

        Parameters
        ----------
        kind : str
            "can" or "cone".
        place : (2,) sequence of float
            In m.
        """
        self._rearrange(lambda: self.lesson.put(kind, place), f"One {kind} more")

    def take_away(self, place):
        """Take away the object that stands at a place.

        Parameters
        ----------
        place : (2,) sequence of float
            In m.
        """
        k = self.lesson.nearest(place)
        if k is None:
            self._refuse(Refused("nothing stands here", place))
        else:
            self._rearrange(lambda: self.lesson.without(k), f"Object {k} is gone")

    def kidnap(self, place):
        """Carry the robot off to a place while it drives; where it does not, it begins there.

        Parameters
        ----------
        place : (2,) sequence of float
            In m.
        """
        if self.lesson.task is None:
            self._say("There is nothing to drive yet. " + INVITATION)
        elif not self.lesson.has_room(place):
            self._refuse(Refused("no room for the robot", place))
        elif self.busy and self._carry is None and self._trail is not None:
            self._carry = place
        else:
            self._begin(lambda: self._driven(place))

    def drive(self):
        """Have the robot drive what it has learned, from the beginning."""
        if self.lesson.task is None:
            self._say("There is nothing to drive yet. " + INVITATION)
        else:
            self._begin(self._driven)

    def start_over(self):
        """Forget everything; the objects stand as in the beginning."""
        self._stop()
        self.lesson = Lesson.begin(self.lesson.background, self._first)
        self.run, self.tool = None, ""
        self.said = INVITATION
        self._draw()

    # ---- what then goes on, in steps between which the mouse is heard

    def _begin(self, make):
        """Begin what goes on in steps; what went on before ends."""
        self._stop()
        try:
            steps = make()
        except Refused as refused:
            self._refuse(refused)
            return
        self._going = steps
        if self.live and (loop := running_loop()):
            self._task = loop.create_task(self._follow(steps))
        else:
            for _ in steps:
                pass
            self._going = None

    async def _follow(self, steps):
        """Go on step by step, as long as nothing else has been begun."""
        for _ in steps:
            await asyncio.sleep(PAUSE)
            if self._going is not steps:
                return
        self._going = None
        self._tell()

    def _stop(self):
        """End what goes on."""
        if self._going is not None:
            self._going.close()
        self._going = self._carry = self._trail = None

    def _rearrange(self, change, words):
        """Another lesson, of other objects; the robot drives if it has something to drive."""
        self._stop()
        try:
            self.lesson = change()
        except Refused as refused:
            self._refuse(refused)
            return
        self.run = None
        if self.lesson.task is None:
            self._say(f"{words}: the robot sees {len(self.lesson.seen)} objects. {INVITATION}")
        else:
            self._begin(lambda: self._driven(words=f"{words}, and the task with it. "))

    def _shown(self, shown):
        """The person walks, the robot learns; then it drives."""
        self.run, first = None, len(self.lesson.demonstrations) == 0
        self._say("The person walks; the robot watches.")
        walk, fan = self._moving("USER"), self._moving("ray")
        person = self._figure_of("person", 0.25, plot.TRUTH)
        trail = []
        steps = lessons.walking(self.lesson, shown, len(self.lesson.demonstrations))
        while True:
            try:
                sight = next(steps)
            except StopIteration as end:
                observed = end.value
                break
            person.center = sight.person
            points = lessons.seen_points(sight)
            trail += near(points, sight.person) if len(points) else [sight.person]
            walk.set_data(*np.transpose(trail or [(np.nan, np.nan)]))
            fan.set_data(*rays(self.lesson.scene.robot.laser_pose, points))
            if round(sight.t * 10) % max(1, sight.of // FRAMES) == 0:
                self._frame(fan, walk, person)
                yield
        try:
            self.lesson = self.lesson.shown(observed)
        except ValueError as error:
            words = f"the robot could not learn from that: {error}"
            self._refuse(Refused(words, shown.positions[0]))
            return
        count = len(self.lesson.task.law.subgoals)
        walks = "one walk" if first else f"{len(self.lesson.demonstrations)} walks"
        words = f"{count} subgoals from {walks}. "
        yield from self._driven(words=words)

    def _driven(self, place=None, words=""):
        """The robot drives the task."""
        self.run = None
        self._say(f"{words}The robot drives. Click, and it is kidnapped.")
        self._trail = trail = [[]]
        path, robot = self._moving("RUN"), self._figure_of("robot", 0.25, plot.ROBOT)
        steps, sent, n = lessons.driving(self.lesson, len(self.lesson.demonstrations), place), None, 0
        while True:
            try:
                controller, body = steps.send(sent)
            except StopIteration as end:
                self.run = end.value
                break
            except ValueError as error:
                self._refuse(Refused(str(error), self.lesson.task.law.start))
                return
            true = getattr(body, "true_pose", body.pose)
            trail[-1].append(true[:2])
            sent, self._carry, n = self._carry, None, n + 1
            if sent is not None:
                self._say(f"Kidnapped to ({sent[0]:.1f}, {sent[1]:.1f}); the robot is not told.")
                trail.append([])
            robot.center = true[:2]
            path.set_data(*broken(trail))
            if n % PERIODS == 0:
                self._frame(path, robot)
                yield
        self._trail = None
        self._draw()
        self._say(outcome(self.run))

    # ---- the mouse

    def _press(self, event):
        if event.inaxes is not self._plan or event.button != 1:
            return
        place = np.array([event.xdata, event.ydata])
        self._drawn, self._held = [place], None
        if not self.tool:
            self._held = self.lesson.nearest(place)

    def _move(self, event):
        if self._drawn is None or event.inaxes is not self._plan:
            return
        place = np.array([event.xdata, event.ydata])
        self._drawn.append(place)
        if np.linalg.norm(np.ptp(self._drawn, axis=0)) < GRASP or self.tool:
            return
        if self.busy:
            self._stop()
        if self._held is None:
            line = self._moving("drawn")
            line.set_data(*np.transpose(self._drawn))
            self._frame(line)
        else:
            shade = self._figure_of("held", 0.2, plot.OBSTACLE)
            shade.center = place
            try:
                self.lesson.free(self._held, place)
            except Refused:
                shade.set(linestyle=":", alpha=0.4)
            else:
                shade.set(linestyle="-", alpha=0.9)
            self._frame(shade)

    def _release(self, event):
        drawn, held, tool = self._drawn, self._held, self.tool
        self._drawn = self._held = None
        if drawn is None:
            return
        if event.inaxes is self._plan:
            drawn.append(np.array([event.xdata, event.ydata]))
        far = np.linalg.norm(np.ptp(drawn, axis=0)) >= GRASP
        left = event.inaxes is not self._plan
        if tool:
            self.tool = ""
            self.take_away(drawn[-1]) if tool == "take away" else self.put(tool, drawn[-1])
        elif far and left:
            self._refuse(Refused("this leaves the room", drawn[-1]))
        elif far and held is None:
            self.show_walk(drawn)
        elif far:
            self.drag(held, drawn[-1])
        elif held is None:
            self.kidnap(drawn[-1])
        else:
            self._say(f"Object {held}: hold the mouse button, and drag it.")

    # ---- what is seen

    def _say(self, words):
        """Say something over the plan, and draw what is so now."""
        self.said = words
        self._draw()

    def _refuse(self, refused):
        """Say at the place itself why something cannot be."""
        self.said = f"Not so: {refused}. Nothing has changed."
        self._draw(refused)

    def _tell(self):
        for hear in self._hearers:
            hear(self)

    def _draw(self, refused=None):
        """The plan and what the robot knows, drawn anew."""
        plan, lesson = self._plan, self.lesson
        with plt.rc_context(plot.STYLE):
            plan.clear()
            draw_room(plan, lesson)
            for k, walk in enumerate(walks_among(lesson)):
                plot.path(plan, walk, None if k else "walk, as seen", linewidth=0.8, alpha=0.6)
            if lesson.task:
                draw_law(plan, lesson.task.law)
            if self.run:
                plot.runs(plan, [self.run])
            if refused is not None:
                show_refusal(plan, refused)
            colour = "black" if refused is None else WARNING
            plan.set_title(shortened(self.said, 86), loc="left", fontsize=9, color=colour)
            handles, labels = plan.get_legend_handles_labels()
            below = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.09), "ncols": 5}
            plan.legend(handles, labels, fontsize=8, **below)
            self._moved = {}
            draw_knowledge(self._known, lesson)
        self.figure.canvas.draw()
        self._tell()

    def _moving(self, name):
        """The line of that name that moves over the still picture."""
        look = {
            "USER": {"color": plot.USER, "marker": ".", "linestyle": "", "markersize": 2},
            "ray": {"color": "0.75", "linewidth": 0.4, "zorder": 1},
            "RUN": {"color": plot.RUN, "linewidth": 2},
            "drawn": {"color": plot.USER, "linewidth": 1.5, "linestyle": "--"},
        }[name]
        if name not in self._moved:
            (self._moved[name],) = self._plan.plot([], [], animated=True, **look)
        return self._moved[name]

    def _figure_of(self, name, radius, colour):
        """The disc of that name that moves over the still picture."""
        if name not in self._moved:
            look = {"facecolor": colour, "edgecolor": "black", "animated": True, "zorder": 7}
            self._moved[name] = self._plan.add_patch(Circle((np.nan, np.nan), radius, **look))
        return self._moved[name]

    def _keep_still(self, _):
        """Keep the picture without what moves."""
        self._still = self.figure.canvas.copy_from_bbox(self.figure.bbox)

    def _frame(self, *moving):
        """One picture of what moves, over the still one."""
        if not self.live:
            return
        canvas = self.figure.canvas
        canvas.restore_region(self._still)
        for each in moving:
            self._plan.draw_artist(each)
        canvas.blit(self.figure.bbox)


def canvas_that_is_heard(figure):
    """A canvas that a notebook shows, and that hears the mouse, for which nothing else asks."""
    from ipympl.backend_nbagg import Canvas, FigureManager

    canvas = Canvas(figure)
    FigureManager(canvas, 0)
    canvas.header_visible = canvas.footer_visible = False
    canvas.toolbar_visible = canvas.resizable = False
    return canvas


def running_loop():
    """The event loop in which a kernel hears the mouse, None where there is none."""
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None


def near(points, person, within=0.35):
    """Those of some points (N, 2) that lie on a person, a list."""
    return list(points[np.linalg.norm(points - person, axis=1) < within])


def rays(pose, points):
    """The beams to some points (N, 2) as one broken line: x and y."""
    parts = np.full((3 * len(points), 2), np.nan)
    parts[::3], parts[1::3] = pose[:2], points
    return parts.T


def broken(parts):
    """Several ways as one broken line: x and y."""
    joined = [point for part in parts for point in (*part, (np.nan, np.nan))]
    return np.transpose(joined)


def outcome(run):
    """In a sentence what came of a run."""
    carried = " although it was kidnapped" if len(run.kidnapped) else ""
    touched = f"touched something {run.collisions} times" if run.collisions else "touched nothing"
    if run.finished:
        spare = f"{100 * run.clearance.min():.0f} cm to spare at least"
        return f"Finished{carried}: {run.t[-1]:.0f} s, {touched}, {spare}."
    return f"Not finished: {run.reason}; it {touched}."


def draw_room(ax, lesson):
    """The room, the robot that watches, the objects as they stand and as the laser sees them."""
    left, low, right, high = lesson.scene.room.bounds
    plot.plane(ax).set(xlim=(left, right), ylim=(low, high))
    for part in lesson.scene.room.furniture:
        ax.add_artist(Polygon(part.outline.border, facecolor=plot.BACKGROUND, alpha=0.3))
    plot.grid_map(ax, lesson.background)
    ax.set(xlim=(left, right), ylim=(low, high))
    for each in lesson.scene.objects:
        ax.add_artist(Polygon(each.footprint.border, facecolor=plot.OBSTACLE, alpha=0.25))
    plot.boxes(ax, lesson.seen.boxes, "objects, as seen")
    plot.robot(ax, lesson.scene.robot.pose, label="robot that watches")


def draw_law(ax, law):
    """The control law, from its start through its numbered subgoals."""
    plot.law(ax, law.response(), "control law")
    plot.subgoals(ax, law.subgoals)
    for k, place in enumerate(law.subgoals, 1):
        look = {"textcoords": "offset points", "path_effects": [plot.HALO], "zorder": 8}
        ax.annotate(str(k), place, (6, 6), **look)
    ax.plot(*law.start, "o", color=plot.LAW, markersize=7, label="start", zorder=6)


def draw_knowledge(ax, lesson):
    """What the robot knows, in words; and how well it foretold each walk."""
    ax.clear()
    objects, walks = len(lesson.seen), len(lesson.demonstrations)
    words = [f"{counted(objects, 'object')} seen", f"{counted(walks, 'walk')} seen"]
    if not lessons.has_laboratory():
        words.append("PyBullet is missing: no laser looks,\nand a unicycle drives")
    if lesson.task:
        errors = ", ".join(f"{100 * each:.0f}" for each in lesson.task.errors())
        subgoals, ways = len(lesson.task.law.subgoals), len(lesson.task.ways)
        words += [f"{counted(subgoals, 'subgoal')}, {counted(ways, 'way')}"]
        words += [f"misses each walk by {errors} cm"]
    doubts = [shortened(each) for each in lesson.doubts] or ["nothing in doubt"]
    ax.text(0, 1, "What the robot knows", weight="bold", va="top", transform=ax.transAxes)
    ax.text(0, 0.94, "\n".join([*words, *doubts]), va="top", fontsize=8, transform=ax.transAxes)
    ax.set_axis_off()
    if lesson.foretold:
        draw_foretold(ax.inset_axes([0.12, 0.08, 0.85, 0.34]), lesson.foretold)


def draw_foretold(ax, foretold):
    """How far each walk was from what the walks before it had foretold."""
    ax.bar(range(2, 2 + len(foretold)), 100 * np.array(foretold), color=plot.USER, width=0.5)
    last = len(foretold) + 1
    ax.set(xlabel="walk", xticks=range(2, last + 1), xlim=(1.4, max(4, last) + 0.6))
    ax.set_title("the next walk foretold wrong by [cm]", fontsize=8)


def counted(number, noun):
    """A number of things in words: "1 walk", "2 walks"."""
    return f"{number} {noun}" + "s" * (number != 1)


def shortened(words, width=34, most=5):
    """Words in short lines, the last with dots where there are more."""
    lines, line = [], ""
    for word in words.split():
        if len(line) + len(word) > width:
            lines.append(line)
            line = ""
        line = f"{line} {word}".strip()
    lines.append(line)
    return "\n".join(lines[:most]) + (" ..." if len(lines) > most else "")


def walks_among(lesson):
    """The walks (N, 2) that were shown among the objects as they stand now."""
    for each in lesson.demonstrations:
        then, now = each.environment.boxes, lesson.seen.boxes
        if then.shape == now.shape and np.abs(then - now).max(initial=0.0) < 0.1:
            yield from each.walks


def show_refusal(ax, refused):
    """A cross where something cannot be, and why."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    place = np.clip(refused.place, [left, low], [right, high])
    ax.plot(*place, "X", color=WARNING, markersize=12, zorder=9)
    side, at = ("right", -10) if place[0] > (left + right) / 2 else ("left", 10)
    look = {"color": WARNING, "weight": "bold", "path_effects": [plot.HALO], "zorder": 9}
    look |= {"textcoords": "offset points", "ha": side}
    ax.annotate(shortened(str(refused), 40), place, (at, 8), **look)
