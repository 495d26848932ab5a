/** The pages' icons: those of Tabler Icons that they use, as decoration beside words. */
import * as tabler from '@tabler/icons-react'

/** Hidden from screen readers, which read the words beside it. */
const decoration = (Icon: tabler.Icon) =>
  function Decoration(props: tabler.IconProps) {
    return <Icon aria-hidden {...props} />
  }

export const IconAdjustmentsHorizontal = decoration(tabler.IconAdjustmentsHorizontal)
export const IconAlertCircle = decoration(tabler.IconAlertCircle)
export const IconAlertTriangle = decoration(tabler.IconAlertTriangle)
export const IconArchive = decoration(tabler.IconArchive)
export const IconArrowBackUp = decoration(tabler.IconArrowBackUp)
export const IconArrowDown = decoration(tabler.IconArrowDown)
export const IconArrowForwardUp = decoration(tabler.IconArrowForwardUp)
export const IconArrowUp = decoration(tabler.IconArrowUp)
export const IconArrowsDiff = decoration(tabler.IconArrowsDiff)
export const IconBell = decoration(tabler.IconBell)
export const IconBookmark = decoration(tabler.IconBookmark)
export const IconChevronDown = decoration(tabler.IconChevronDown)
export const IconChevronRight = decoration(tabler.IconChevronRight)
export const IconColumns = decoration(tabler.IconColumns)
export const IconCopy = decoration(tabler.IconCopy)
export const IconDots = decoration(tabler.IconDots)
export const IconDownload = decoration(tabler.IconDownload)
export const IconGripVertical = decoration(tabler.IconGripVertical)
export const IconMaximize = decoration(tabler.IconMaximize)
export const IconMinimize = decoration(tabler.IconMinimize)
export const IconMoon = decoration(tabler.IconMoon)
export const IconPencil = decoration(tabler.IconPencil)
export const IconPin = decoration(tabler.IconPin)
export const IconPlayerPlay = decoration(tabler.IconPlayerPlay)
export const IconPlayerStop = decoration(tabler.IconPlayerStop)
export const IconPlus = decoration(tabler.IconPlus)
export const IconRefresh = decoration(tabler.IconRefresh)
export const IconRobot = decoration(tabler.IconRobot)
export const IconRocket = decoration(tabler.IconRocket)
export const IconRotateClockwise = decoration(tabler.IconRotateClockwise)
export const IconSearch = decoration(tabler.IconSearch)
export const IconStar = decoration(tabler.IconStar)
export const IconStarFilled = decoration(tabler.IconStarFilled)
export const IconSun = decoration(tabler.IconSun)
export const IconTag = decoration(tabler.IconTag)
export const IconTrash = decoration(tabler.IconTrash)
export const IconUpload = decoration(tabler.IconUpload)
export const IconX = decoration(tabler.IconX)
