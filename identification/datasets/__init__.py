"""Public data sets by name (none is part of this project; see `catalogue`)."""

from identification.datasets.catalogue import KNOWN as KNOWN
from identification.datasets.catalogue import SETS as SETS
from identification.datasets.catalogue import KnownRecording as KnownRecording
from identification.datasets.catalogue import LoadedRecording as LoadedRecording
from identification.datasets.catalogue import about as about
from identification.datasets.catalogue import available as available
from identification.datasets.catalogue import load as load
from identification.datasets.catalogue import names as names
from identification.datasets.catalogue import protocol as protocol
from identification.datasets.catalogue import public_set as public_set
from identification.datasets.catalogue import set_available as set_available
from identification.datasets.places import FOLDER_VARIABLE as FOLDER_VARIABLE
from identification.datasets.public_set import Protocol as Protocol
from identification.datasets.public_set import PublicSet as PublicSet
from identification.datasets.public_set import SetPart as SetPart
