"""Every code of an error: a stable word for scripts, what it means, and what to do about it.

The reference page of the documentation is made from this list.
"""

from enum import StrEnum
from typing import Self


class Code(StrEnum):
    """The codes of `HandeyeError`, each equal to its word. Drivers of others may have words of their own.

    Attributes
    ----------
    meaning
        What was found, in a few words.
    advice
        What to do; the command line shows it where an error has no hint of its own.

    Examples
    --------
    >>> from handeye.codes import Code
    >>> print(Code.MISSING_FILE, Code.MISSING_FILE.advice, sep=": ")
    missing_file: check the name and the folder
    """

    meaning: str
    advice: str

    def __new__(cls, word: str, meaning: str, advice: str) -> Self:
        """Return the member of a word, with its wording."""
        member = str.__new__(cls, word)
        member._value_ = word
        member.meaning, member.advice = meaning, advice
        return member

    # Two lines a member, as a table; the formatter would make five of them.
    # fmt: off
    # The command line and what has no code of its own
    ERROR = ("error", "something went wrong that has no code of its own",
        "do what the message says")
    INVALID_INPUT = ("invalid_input", "the input cannot be used",
        "correct what the message names")
    LIBRARY_MISSING = ("library_missing", "the library of a device is not installed or does not load",
        "install the extra of the driver")
    MISSING_LIBRARY = ("missing_library", "a library that unpacks this file is not installed",
        "install the extra that the message names")
    MISSING_PACKAGE = ("missing_package", "an optional package is not installed",
        "install the extra that the message names")
    MISSING_VALUE = ("missing_value", "something that is needed was not given",
        "give what the message names")
    UNEXPECTED = ("unexpected", "a mistake in handeye itself",
        "report it with the command and what --debug prints")
    USAGE = ("usage", "the command line is not understood",
        "look at --help of the command")
    # Files and folders
    AMBIGUOUS_FORMAT = ("ambiguous_format", "the files fit more than one layout, or none alone",
        "name the layout or the single file that is meant")
    DAMAGED_BAG = ("damaged_bag", "a bag is damaged or not as its format says",
        "copy it again, or record it again")
    EXISTS = ("exists", "the output is there already",
        "choose another name")
    INVALID_XML = ("invalid_xml", "the XML of an arm cannot be read",
        "repair the line that the message names")
    MISSING_FILE = ("missing_file", "a file or folder is not there",
        "check the name and the folder")
    MISSING_TOPIC = ("missing_topic", "a bag has no topic of the kind that is needed",
        "name the topic, or record it too")
    NEWER_VERSION = ("newer_version", "a file was written by a later version",
        "update handeye")
    NO_RESULT = ("no_result", "the file holds an error and no result",
        "solve again")
    NOT_EXACT = ("not_exact", "what was written does not read back the same",
        "write another format, and report it")
    NOT_FINITE = ("not_finite", "a number is not finite",
        "remove or repair the value that the message names")
    NOT_JSON = ("not_json", "a file is not JSON as expected",
        "repair it, or write it again")
    NOT_NUMBERS = ("not_numbers", "a field is not a number",
        "repair the field that the message names")
    NOT_TEXT = ("not_text", "a file is not UTF-8 text",
        "save it as UTF-8, or give the right file")
    NOT_TOML = ("not_toml", "a file is not TOML as expected",
        "repair the line, or write the file again")
    NOT_WRITTEN = ("not_written", "a result cannot be written",
        "check the folder, its permissions and the free space")
    NOT_XML = ("not_xml", "a file is not XML as expected",
        "repair it, or write it again")
    NOT_YAML = ("not_yaml", "a file is not YAML as expected",
        "repair it, or write it again")
    OPTIONS_UNUSED = ("options_unused", "options were given that the recording states itself",
        "leave the options out")
    PATH_OUTSIDE = ("path_outside", "a path leads out of the folder",
        "put the file into the folder and name it relative to it")
    TOO_LARGE = ("too_large", "a file or a value in it is larger than allowed",
        "check that it is the right file, or cut it into smaller ones")
    TRUNCATED = ("truncated", "a recording holds fewer or more views than it says",
        "copy the file again, or correct its count")
    UNKNOWN_FORMAT = ("unknown_format", "the format or the ending of the file is not known",
        "use one of the formats that the message names")
    UNREADABLE = ("unreadable", "a file or folder cannot be read",
        "check its permissions, and copy it again if it is damaged")
    UNSAFE_XML = ("unsafe_xml", "the XML has a document type or an entity",
        "remove <!DOCTYPE ...> and what belongs to it")
    # Values, names and counts
    CONTRADICTION = ("contradiction", "what is stated and what the file says disagree",
        "leave the option out, or correct the file")
    COUNTS_DIFFER = ("counts_differ", "two lists that belong together differ in length",
        "give one entry for each on both sides")
    DUPLICATE_CANDIDATE = ("duplicate_candidate", "two candidates have one name",
        "rename one of them")
    DUPLICATE_POINT = ("duplicate_point", "a view has a point more than once",
        "keep one observation of each point in a view")
    DUPLICATE_VALUE = ("duplicate_value", "a value or a name is there twice",
        "remove one of the two")
    DUPLICATE_VIEW = ("duplicate_view", "two views have one name",
        "rename or remove one of them")
    INVALID_FIELD = ("invalid_field", "a field has a value that it cannot have",
        "correct the field that the message names")
    INVALID_NAME = ("invalid_name", "a name is not allowed or is used already",
        "choose another name")
    NOT_FOUND = ("not_found", "data of a study are not in the folder",
        "check the folder, or generate the data")
    OUT_OF_RANGE = ("out_of_range", "a number is outside its range",
        "give a value in the range that the message names")
    UNKNOWN_KIND = ("unknown_kind", "no data fault has this name",
        "use one of the names that the message gives")
    UNKNOWN_VIEW = ("unknown_view", "no usable view has this name",
        "choose one of the views of the recording")
    WRONG_SHAPE = ("wrong_shape", "an array has the wrong shape or type",
        "give the shape that the message names")
    WRONG_TYPE = ("wrong_type", "a message of the page is not of the expected type",
        "load the page again")
    # What the poses mean
    MOUNTING_UNSTATED = ("mounting_unstated", "nothing says where the camera sits",
        "state --mounting eye_in_hand or eye_to_hand")
    NO_POSES = ("no_poses", "no poses that can be used were found",
        "check that the recording has the robot's poses and that it moves")
    NO_STATIONS = ("no_stations", "the arm never stood still while a picture was taken",
        "let the arm stand before each picture")
    NOT_RIGID = ("not_rigid", "a transform is not rigid, or cameras do not move as one",
        "check the rotations and where each camera sits")
    NOTATION_UNSTATED = ("notation_unstated", "nothing says how the poses are written",
        "state --notation and --unit")
    UNKNOWN_DIRECTION = ("unknown_direction", "the direction of the poses is not known",
        "use one that the message names")
    UNKNOWN_FRAME = ("unknown_frame", "frames of tf are not known or not connected",
        "name them with --base-frame and --flange-frame")
    UNKNOWN_NOTATION = ("unknown_notation", "the notation of rotations is not known",
        "use one from docs/conventions.md")
    UNKNOWN_UNIT = ("unknown_unit", "the unit is not known",
        "use one that the message names")
    WRONG_ROTATION = ("wrong_rotation", "the pictures disagree with the stated rotations",
        "correct the statement as the message says")
    WRONG_UNIT = ("wrong_unit", "the pictures disagree with the stated unit",
        "correct the statement as the message says")
    # Pictures, cameras and targets
    ANOTHER_TARGET = ("another_target", "the pictures show another target than before",
        "use the same target, stated alike")
    BAD_FRAME = ("bad_frame", "a camera gave a frame that cannot be used",
        "correct the camera's driver or its settings")
    BAD_IMAGE = ("bad_image", "a picture has a format that cannot be used",
        "let the camera give grey or colour values of 8 bits")
    CAMERA_CHANGED = ("camera_changed", "the camera changed during the session",
        "keep size and focus fixed, and begin a new session")
    DAMAGED_IMAGE = ("damaged_image", "a picture is damaged",
        "copy the file again")
    DOES_NOT_FIT = ("does_not_fit", "the target does not fit on the paper",
        "use larger paper or a smaller target")
    FOLDER_GONE = ("folder_gone", "the folder that is watched cannot be read",
        "make the folder available again")
    IMAGE_SIZE = ("image_size", "pictures and camera file are of different sizes",
        "calibrate the camera at the size of the pictures")
    NO_CAMERA = ("no_camera", "the camera was not found or cannot be opened",
        "check its cable, its power and its name")
    NO_CAMERA_INFO = ("no_camera_info", "no camera_info was received",
        "check that the camera publishes it")
    NO_IMAGE = ("no_image", "no picture came from the camera",
        "check the cable, the power and the trigger")
    NO_IMAGES = ("no_images", "the folder has no pictures",
        "check the folder")
    NO_PICTURES = ("no_pictures", "there are poses of the target and no pictures",
        "give pictures or corners")
    NO_POINTS = ("no_points", "no points of a target were seen",
        "check that the target is in view")
    NOT_AN_IMAGE = ("not_an_image", "a file or message is not a picture of a known kind",
        "give a picture in one of the known formats")
    NOT_CALIBRATED = ("not_calibrated", "a camera file holds no calibration",
        "calibrate the camera, or leave the file out")
    NOT_DETECTED = ("not_detected", "the target was not found",
        "check the light, the focus and the description of the target")
    PATTERN_UNKNOWN = ("pattern_unknown", "the size of the chessboard is not stated",
        "give --rows and --columns, or --target")
    PIXEL_OUTSIDE = ("pixel_outside", "a corner lies outside the picture",
        "check the picture size of the camera and the corners")
    POINT_OUT_OF_RANGE = ("point_out_of_range", "a point number is not on the target",
        "check the size of the pattern")
    SEVERAL_CAMERAS = ("several_cameras", "this needs one camera and there are several",
        "name one camera, or leave the option out")
    TRUNCATED_IMAGE = ("truncated_image", "a picture is cut off",
        "copy the file again")
    UNKNOWN_CAMERA = ("unknown_camera", "a camera name is not known",
        "use a name that the message gives")
    UNKNOWN_DICTIONARY = ("unknown_dictionary", "the dictionary of markers is not known",
        "use one that the message names")
    UNKNOWN_LENS = ("unknown_lens", "the lens model is not known",
        "calibrate with a lens model that the message names")
    UNKNOWN_PAPER = ("unknown_paper", "the paper size is not known",
        "name a known size, or WIDTHxHEIGHT in mm")
    UNKNOWN_POINT = ("unknown_point", "the target has no such point",
        "choose a point of the target")
    UNKNOWN_TARGET = ("unknown_target", "the target is not known or not stated wholly",
        "describe it with --target")
    UNSUPPORTED_CAMERA = ("unsupported_camera", "the renderer cannot show this camera",
        "use a camera without distortion and with one focal length")
    UNSUPPORTED_TARGET = ("unsupported_target", "this study does not take this target",
        "use a chessboard")
    WRONG_IMAGE_SIZE = ("wrong_image_size", "a picture has another size than the camera",
        "take pictures at the size of the calibration")
    # Arms
    AMBIGUOUS_ARM = ("ambiguous_arm", "the description leaves base or flange open",
        "name the base and the flange")
    NO_ARM = ("no_arm", "this needs the kinematics of the arm",
        "give the arm's description")
    NO_JOINTS = ("no_joints", "joint positions are missing",
        "give the joint positions of every view")
    NO_SHAPES = ("no_shapes", "the description has no shapes of links",
        "give a description with collision shapes")
    NO_TOUCHES = ("no_touches", "there is no touch",
        "touch at least three points")
    NOT_MJCF = ("not_mjcf", "the file is not a MuJoCo model",
        "give a MuJoCo model")
    NOT_URDF = ("not_urdf", "the file is not a URDF",
        "give a robot description in URDF")
    OTHER_ARM = ("other_arm", "this format does not take such an arm",
        "choose another format")
    OUT_OF_REACH = ("out_of_reach", "the arm cannot reach the pose",
        "choose a pose nearer to the base, or another orientation")
    SAME_BODY = ("same_body", "both points of a touch are on one body",
        "let one point move with the flange and the other stand still")
    UNKNOWN_ARM = ("unknown_arm", "joint positions without a known arm",
        "name the arm or its URDF with --robot")
    UNKNOWN_LINK = ("unknown_link", "the description has no such link",
        "use a name that the description has")
    UNKNOWN_ROBOT = ("unknown_robot", "the simulated cell has another robot",
        "leave --robot out")
    UNKNOWN_TIP = ("unknown_tip", "no tip has this name",
        "use a name of a stated tip")
    UNUSABLE_ARM = ("unusable_arm", "the description cannot be used as an arm",
        "correct the description, or name other links")
    UNUSABLE_MESH = ("unusable_mesh", "a mesh cannot be used",
        "give a mesh with faces in a known format")
    UNUSABLE_MJCF = ("unusable_mjcf", "the MuJoCo model has a part that cannot be used",
        "correct the line that the message names")
    UNUSABLE_URDF = ("unusable_urdf", "the URDF has a part that cannot be used",
        "correct the line that the message names")
    WRONG_ARM = ("wrong_arm", "the joints are not those of the arm",
        "give the description of this robot with --robot")
    # The estimate
    CAMERA_NOT_DETERMINED = ("camera_not_determined", "the views do not determine the lens",
        "take more tilted views, with the target near the edges too")
    DEGENERATE = ("degenerate", "the views leave part of the answer undetermined",
        "take views with turns about different axes")
    DIVERGED = ("diverged", "the fit did not come to a minimum",
        "check that poses and pictures belong together, and their units")
    INCONSISTENT = ("inconsistent", "poses and observations contradict each other",
        "check the mounting, the unit and the order of the poses")
    NO_START = ("no_start", "no start was found",
        "take other views, or give the joints to start from")
    NO_VIEWS = ("no_views", "no suitable views were found",
        "widen what is allowed of the views")
    NOT_CONVERGED = ("not_converged", "the calibration of the camera did not converge",
        "take more views, or a lens with fewer parameters")
    NOT_SOLVED = ("not_solved", "a numerical step failed",
        "check the data with handeye doctor")
    NOT_TIED = ("not_tied", "a camera is not tied to the arm or to another camera",
        "let it see a target together with another camera")
    TOO_FEW_POINTS = ("too_few_points", "a view has too few points",
        "leave the view out, or take it again")
    TOO_FEW_VIEWS = ("too_few_views", "there are too few usable views",
        "take more views, tilted differently")
    # Planning
    NO_CANDIDATE = ("no_candidate", "no candidate is left",
        "give other --candidates")
    NO_CANDIDATES = ("no_candidates", "no views are left to order",
        "give possible views, or let fewer count as taken")
    TOO_FEW_CANDIDATES = ("too_few_candidates", "too few candidates can be taken",
        "offer more candidates that show the target")
    UNKNOWN_CRITERION = ("unknown_criterion", "the objective is not known",
        "use one that the message names")
    UNKNOWN_POLICY = ("unknown_policy", "the policy is not known or is no policy",
        "use one that the message names")
    UNUSABLE_VIEW = ("unusable_view", "a view cannot be used",
        "leave the view out")
    # Sessions and devices
    BAD_ADDRESS = ("bad_address", "the address of a device is not as its driver expects",
        "write it as the message says")
    BAD_CALIBRATION = ("bad_calibration", "the calibration file of an arm cannot be used",
        "calibrate the arm's joints again")
    BAD_PROGRAM = ("bad_program", "the test controller does not know this program",
        "use commands that it knows")
    BAD_READING = ("bad_reading", "the robot gave a reading that cannot be used",
        "check the robot, its driver and the cable")
    BAD_STAMP = ("bad_stamp", "a message has no usable time stamp",
        "let the clocks of both machines agree")
    BUSY = ("busy", "the device is busy",
        "end the other program, and check the cable")
    CONNECTION_LOST = ("connection_lost", "the connection to the device was lost",
        "check the cable, the power and the network")
    DEVICE_FAILED = ("device_failed", "a robot or a camera did not do what it was asked",
        "look at the device and try again")
    DRIVER_FAILED = ("driver_failed", "a driver raised an error of its own",
        "look at the message and the driver")
    EDITED = ("edited", "the files of a session were edited",
        "undo the change, or begin a new session")
    IN_USE = ("in_use", "another process works with the folder",
        "wait for it, or end it")
    JOURNAL_CUT = ("journal_cut", "the journal of a session was cut",
        "restore it from a copy")
    MOTION_REFUSED = ("motion_refused", "the robot refuses a motion",
        "choose a pose that the robot can reach safely")
    NO_ANSWER = ("no_answer", "nobody answered",
        "run it in a terminal and answer")
    NO_DESCRIPTION = ("no_description", "no description of the robot was received",
        "check that its topic is published")
    NO_ROBOT = ("no_robot", "the robot was not found",
        "open its station, and name the robot as it does")
    NO_WORKSPACE = ("no_workspace", "no workspace is stated",
        "state the box that the flange may move in")
    NOT_AT_REST = ("not_at_rest", "the arm does not come to rest",
        "check its load and what disturbs it")
    NOT_READY = ("not_ready", "the robot is not ready",
        "clear its error, and switch it on for remote control")
    NOTHING_RECORDED = ("nothing_recorded", "nothing was recorded for this",
        "choose what the recording holds")
    SETTINGS_CHANGED = ("settings_changed", "a setting changed since the session began",
        "undo the change, or begin a new session")
    STOP_FAILED = ("stop_failed", "the robot could not be stopped",
        "stop it by hand, and check its driver")
    STOPPED = ("stopped", "the robot stopped before its goal",
        "find what stopped it before you go on")
    TIMEOUT = ("timeout", "an answer did not come in time",
        "check the cable, the power and the network")
    UNKNOWN_DRIVER = ("unknown_driver", "the driver is not known",
        "use one that the message names, or install its package")
    UNSAFE_START = ("unsafe_start", "the arm stands where it may not go",
        "drive it to a free place, or correct the workspace")
    WRONG_PROTOCOL = ("wrong_protocol", "the device does not speak the expected protocol",
        "check the address and the version of its software")
    # The page
    ADDRESS = ("address", "the page cannot be served at this address",
        "choose another --ui-port")
    LATE_ANSWER = ("late_answer", "the question is not open any more",
        "load the page again")
    NO_UPLOAD = ("no_upload", "no picture is waited for",
        "wait until one is asked for")
    NOT_DRIVING = ("not_driving", "this page only looks on",
        "use the page that drives")
    NOT_WATCHING = ("not_watching", "this page does not look on",
        "load the page again")
    TOO_MANY = ("too_many", "too many pages look on",
        "close one of them")
    UNKNOWN_ACTION = ("unknown_action", "the page asks for an unknown action",
        "load the page again")
    UNKNOWN_DOCUMENT = ("unknown_document", "the page asks for an unknown document",
        "load the page again")
    # Studies and clusters
    BENCHMARK_FAILED = ("benchmark_failed", "a measurement failed",
        "look at the message and run it again")
    CLUSTER_FAILED = ("cluster_failed", "a piece of work failed in the cluster",
        "look at the worker's log")
    NO_DASK = ("no_dask", "Dask is not installed",
        "pip install 'handeye[cluster]'")
    NO_DATA = ("no_data", "data of the study are not there",
        "name their folder")
    NO_SCHEDULER = ("no_scheduler", "no Dask scheduler answers",
        "start one with: dask scheduler")
    NO_TRUTH = ("no_truth", "the recording has no truth to compare with",
        "use a recording with a stated truth")
    OTHER_PROGRAM = ("other_program", "a worker runs other versions",
        "install the same package everywhere")
    UNSUPPORTED = ("unsupported", "this system does not offer what is measured",
        "run it on another system")
    WORKERS_DIE = ("workers_die", "workers of the cluster die",
        "give them more memory, or run fewer of them")
    WRONG_MOUNTING = ("wrong_mounting", "two calibrations are of different transforms",
        "compare calibrations of one camera")
    # fmt: on


def advice(code: str) -> str | None:
    """Return what to do about a code, None for a word of another package."""
    return {str(known): known.advice for known in Code}.get(code)
